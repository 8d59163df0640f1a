//! Compares every instruction set with the readable version, bit for bit, and the readable version with the definition.

use proptest::prelude::*;

use super::*;
use crate::sized;

/// Pseudo-random numbers in -1..1 that depend only on the seed.
fn noise(seed: u64, n: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(2654435761) | 1;
    std::iter::repeat_with(|| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 40) as f64 / (1_u64 << 23) as f64 - 1.0
    })
    .take(n)
    .collect()
}

/// Filters of given sizes, and maps with a border of cells that only some filters reach.
struct Problem {
    filters: Vec<([usize; 2], Vec<f64>)>,
    maps: Vec<([usize; 2], Vec<f32>)>,
    /// Size of the largest filter.
    largest: [usize; 2],
}

impl Problem {
    fn new(filters: &[([usize; 2], usize)], sizes: &[[usize; 2]], seed: u64) -> Self {
        let largest =
            [0, 1].map(|axis| filters.iter().map(|filter| filter.0[axis]).max().unwrap_or(1));
        let filters = filters
            .iter()
            .flat_map(|(size, n)| std::iter::repeat_n(*size, *n))
            .enumerate()
            .map(|(nth, size)| {
                (
                    size,
                    noise(seed ^ nth as u64, size[0] * size[1] * N_CHANNELS),
                )
            })
            .collect();
        let maps = sizes.iter().enumerate().map(|(nth, size)| {
            let area = (size[0] + largest[0] - 1) * (size[1] + largest[1] - 1);
            let cells = noise(!seed ^ nth as u64, area * N_CHANNELS);
            (*size, cells.into_iter().map(|cell| cell as f32).collect())
        });
        Self {
            filters,
            maps: maps.collect(),
            largest,
        }
    }

    fn templates(&self) -> Vec<Template<'_>> {
        self.filters
            .iter()
            .map(|(size, weights)| Template {
                rows: size[0],
                cols: size[1],
                weights,
            })
            .collect()
    }

    fn levels(&self) -> impl Iterator<Item = Level<'_>> + Clone {
        self.maps.iter().map(|(size, cells)| Level {
            map: FeatureMap {
                rows: size[0] + self.largest[0] - 1,
                cols: size[1] + self.largest[1] - 1,
                cells,
            },
            size: *size,
        })
    }

    /// Responses `levels x filters` of some panels.
    fn responses(&self, bank: &FilterBank, panels: Range<usize>) -> Vec<Vec<f32>> {
        let n_filters = bank.filters(panels.clone()).len();
        let areas: Vec<_> = self.maps.iter().map(|(size, _)| size[0] * size[1]).collect();
        let mut out = vec![f32::NAN; n_filters * areas.iter().sum::<usize>()];
        bank.correlate(
            panels,
            self.levels(),
            &mut out,
            &mut CorrelateWorkspace::default(),
        );
        let mut rest = &out[..];
        let each = areas.iter().flat_map(|area| std::iter::repeat_n(*area, n_filters));
        each.map(|area| rest.split_off(..area).map(<[f32]>::to_vec).unwrap_or_default())
            .collect()
    }

    fn method(filter: [usize; 2], size: [usize; 2]) -> Method {
        Panel::new(0, filter, true).method(size)
    }

    fn reference(&self) -> Vec<Vec<f32>> {
        let of = |level: Level<'_>| {
            let all = self.templates().into_iter();
            let all = all.map(|template| {
                (
                    Self::method([template.rows, template.cols], level.size),
                    template,
                )
            });
            all.map(|(way, it)| reference::correlate(way, it, level)).collect::<Vec<_>>()
        };
        self.levels().flat_map(of).collect()
    }
}

/// For each channel, the largest absolute value in the cells that are less than ten cells away from those under the filter.
fn largest_near(level: Level<'_>, filter: [usize; 2], at: [usize; 2]) -> [f64; N_CHANNELS] {
    let near =
        |axis: usize, n: usize| at[axis].saturating_sub(9)..n.min(at[axis] + filter[axis] + 9);
    let mut all = [0.0_f64; N_CHANNELS];
    for y in near(0, level.map.rows) {
        for x in near(1, level.map.cols) {
            let cell = &level.map.cells[(y * level.map.cols + x) * N_CHANNELS..];
            for (largest, value) in all.iter_mut().zip(cell) {
                *largest = largest.max(f64::from(value.abs()));
            }
        }
    }
    all
}

/// Checks the error bound of [`FilterBank::correlate`] for all responses, and returns the largest ratio of error to bound.
fn share_of_bound(problem: &Problem, bank: &FilterBank, got: &[Vec<f32>]) -> f64 {
    let mut got = got.iter();
    let mut largest = 0.0_f64;
    for level in problem.levels() {
        let cells: Vec<_> = level.map.cells.iter().map(|&cell| f64::from(cell)).collect();
        for (index, filter) in problem.templates().into_iter().enumerate() {
            let map_size = [level.map.rows, level.map.cols];
            let want = correlate_f64(filter, map_size, &cells, level.size);
            let panels = 0..bank.n_panels();
            let panel =
                panels.clone().find(|&panel| bank.filters(panel..panel + 1).contains(&index));
            let factor = bank.error_factor(panel.unwrap_or(0), level.size);
            let sums: Vec<f64> = (0..N_CHANNELS)
                .map(|k| filter.weights[k..].iter().step_by(N_CHANNELS).map(|w| w.abs()).sum())
                .collect();
            let got = got.next().map_or(&[][..], |values| values);
            assert_eq!(got.len(), want.len());
            for (at, (got, want)) in got.iter().zip(want).enumerate() {
                let place = [at / level.size[1], at % level.size[1]];
                let near = largest_near(level, [filter.rows, filter.cols], place);
                let bound = factor * near.iter().zip(&sums).map(|(x, w)| x * w).sum::<f64>();
                largest = largest.max((f64::from(*got) - want).abs() / bound);
            }
        }
    }
    largest
}

/// A size of filters, and the number of filters.
fn filters() -> impl Strategy<Value = ([usize; 2], usize)> {
    let side = 1..sized(8, 4);
    ([side.clone(), side], 1..sized(20, 3))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(sized(40, 1) as u32))]

    /// Uses up to 70 columns and 40 filters of mixed sizes, so that incomplete blocks of every size occur.
    #[test]
    fn every_instruction_set_equals_the_readable_version_bit_for_bit(
        sizes in prop::collection::vec([1..sized(12, 9), 1..sized(70, 20)], 1..sized(4, 2)),
        filters in prop::collection::vec(filters(), 1..sized(3, 2)),
        seed in any::<u64>(),
    ) {
        let problem = Problem::new(&filters, &sizes, seed);
        let want = problem.reference();
        for isa in Isa::available() {
            let bank = FilterBank::new(isa, &problem.templates());
            let got = problem.responses(&bank, 0..bank.n_panels());
            prop_assert!(got == want, "{:?}", isa);
        }
    }

    /// Includes large terms that cancel each other, for which tiles are least accurate.
    #[test]
    fn responses_keep_the_documented_error_bound(
        size in [1..sized(30, 9), 1..sized(30, 9)],
        (filter, _) in filters(),
        seed in any::<u64>(),
        large in 0..3_u32,
    ) {
        let mut problem = Problem::new(&[(filter, sized(3, 1))], &[size], seed);
        for (_, cells) in &mut problem.maps {
            for cell in cells { *cell += 10_f32.powi(large as i32) - 1.0; }
        }
        let bank = FilterBank::new(Isa::best(), &problem.templates());
        let got = problem.responses(&bank, 0..bank.n_panels());
        let share = share_of_bound(&problem, &bank, &got);
        prop_assert!(share <= 1.0, "{share}");
    }
}

/// Tests that computing other levels and panels at the same time never changes a response.
#[test]
fn responses_do_not_depend_on_what_is_computed_together() {
    let sizes = [[7, 9], [1, 1], [21, 30], [40, 13], [2, 50]];
    let filters = [
        ([sized(5, 3); 2], sized(70, 1)),
        ([6, 4], sized(3, 0)),
        ([2, 2], sized(40, 1)),
    ];
    let problem = Problem::new(&filters, &sizes[..sized(5, 2)], 3);
    let bank = FilterBank::new(Isa::best(), &problem.templates());
    let together = problem.responses(&bank, 0..bank.n_panels());
    let n = problem.filters.len();
    for panel in 0..bank.n_panels() {
        let alone = problem.responses(&bank, panel..panel + 1);
        let filters = bank.filters(panel..panel + 1);
        for (level, got) in alone.chunks(filters.len()).enumerate() {
            let want = &together[level * n..][filters.clone()];
            assert!(got == want, "level {level}, filters {filters:?}");
        }
    }
}

/// The worst-case bound is far above the errors for noise. This is the largest accepted ratio of the bound to these errors.
#[test]
fn the_error_bound_is_not_far_too_large() {
    for side in [1, 4, 5, 6].into_iter().take(sized(4, 2)) {
        let filter = [side; 2];
        let problem = Problem::new(&[(filter, sized(8, 1))], &[[sized(24, 9); 2]], 7);
        let bank = FilterBank::new(Isa::best(), &problem.templates());
        let got = problem.responses(&bank, 0..bank.n_panels());
        let share = share_of_bound(&problem, &bank, &got);
        assert!(share > 2e-5, "{filter:?}: {share}");
    }
}

#[test]
fn a_single_weight_copies_its_channel() {
    let mut weights = vec![0.0; 2 * 3 * N_CHANNELS];
    weights[(3 + 2) * N_CHANNELS + 7] = 2.0;
    let template = Template {
        rows: 2,
        cols: 3,
        weights: &weights,
    };
    let bank = FilterBank::new(Isa::best(), &[template]);
    let cells: Vec<_> = (0..4 * 5 * N_CHANNELS).map(|i| i as f32).collect();
    let map = FeatureMap {
        rows: 4,
        cols: 5,
        cells: &cells,
    };
    let mut out = [f32::NAN; 9];
    let level = Level { map, size: [3, 3] };
    let mut workspace = CorrelateWorkspace::default();
    bank.correlate(0..1, std::iter::once(level), &mut out, &mut workspace);
    for (at, got) in out.iter().enumerate() {
        let (y, x) = (at / 3 + 1, at % 3 + 2);
        assert_eq!(*got, 2.0 * cells[(y * 5 + x) * N_CHANNELS + 7]);
    }
}

/// Tests which method is chosen for which sizes, so that a change of the rule is noticed.
#[test]
fn the_method_depends_on_sizes_only() {
    assert_eq!(Problem::method([2, 5], [100, 100]), Method::Direct);
    assert_eq!(Problem::method([7, 7], [100, 100]), Method::Direct);
    assert_eq!(Problem::method([5, 5], [1, 1]), Method::Direct);
    assert_eq!(Problem::method([5, 5], [8, 8]), Method::Tiles(0));
    assert_eq!(Problem::method([5, 5], [12, 12]), Method::Tiles(1));
    assert_eq!(Problem::method([6, 6], [100, 100]), Method::Tiles(1));
}

#[test]
fn blocks_cover_every_index_once_and_respect_the_maximum_size() {
    for total in 0..70 {
        let all: Vec<_> = blocks(total, 14).collect();
        assert!(all.iter().all(|block| (1..=14).contains(&block.len())));
        assert_eq!(
            all.into_iter().flatten().collect::<Vec<_>>(),
            (0..total).collect::<Vec<_>>()
        );
    }
}
