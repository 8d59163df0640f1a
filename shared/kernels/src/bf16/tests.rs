//! The matrix unit against the readable version, to the bit; that against the definition.

use proptest::prelude::*;

use super::*;
use crate::correlate::correlate_f64;
use crate::sized;

/// Numbers in -1..1 that look random and depend on the seed only.
fn noise(seed: u64) -> impl Iterator<Item = f64> {
    let mut state = seed.wrapping_mul(2654435761) | 1;
    std::iter::repeat_with(move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) as f64 / (1_u64 << 23) as f64 - 1.0
    })
}

/// Filters of given sizes, and maps with a ring of cells that only some of them reach.
struct Problem {
    filters: Vec<([usize; 2], Vec<f64>)>,
    /// Placements, size and cells of every map.
    maps: Vec<([usize; 2], [usize; 2], Vec<f32>)>,
}

impl Problem {
    fn new(filters: &[([usize; 2], usize)], sizes: &[[usize; 2]], seed: u64) -> Self {
        let mut noise = noise(seed);
        let largest = [0, 1].map(|axis| filters.iter().map(|it| it.0[axis]).max().unwrap_or(1));
        let each = filters.iter();
        let each = each.flat_map(|(size, n)| std::iter::repeat_n(*size, *n));
        let mut weights = |[rows, cols]: [usize; 2]| {
            let n = rows * cols * N_CHANNELS;
            ([rows, cols], noise.by_ref().take(n).collect())
        };
        let filters = each.map(&mut weights).collect();
        let maps = sizes.iter().map(|&size| {
            let map = [0, 1].map(|axis| size[axis] + largest[axis] - 1);
            let n = map[0] * map[1] * N_CHANNELS;
            let cells = noise.by_ref().take(n).map(|it| it as f32);
            (size, map, cells.collect())
        });
        let maps = maps.collect();
        Self { filters, maps }
    }

    /// The same, every value times a power of two of its own, `2^-n` to `2^n`.
    fn spread(mut self, n: i32, seed: u64) -> Self {
        let mut noise = noise(!seed);
        let mut factor = || 2.0_f64.powi((noise.next().unwrap() * f64::from(n)) as i32);
        for (_, weights) in &mut self.filters {
            for it in weights {
                *it *= factor();
            }
        }
        for (.., cells) in &mut self.maps {
            for it in cells {
                *it *= factor() as f32;
            }
        }
        self
    }

    fn templates(&self) -> Vec<Template<'_>> {
        let filters = self.filters.iter();
        filters
            .map(|(size, weights)| Template {
                rows: size[0],
                cols: size[1],
                weights,
            })
            .collect()
    }

    /// Responses `levels x filters` of some panels, one after the other.
    fn responses(&self, bank: &Bf16Bank, panels: Range<usize>) -> Vec<f32> {
        let rounded = |([..], [rows, cols], cells): &([usize; 2], [usize; 2], Vec<f32>)| {
            let mut map = Bf16Map::default();
            // Larger than what follows: what is left of it must not matter.
            let before = vec![f32::NAN; (rows + 1) * cols * N_CHANNELS];
            for (rows, cells) in [(rows + 1, &before), (*rows, cells)] {
                let cols = *cols;
                map.round(Isa::best(), FeatureMap { rows, cols, cells });
            }
            map
        };
        let maps: Vec<_> = self.maps.iter().map(rounded).collect();
        let levels = maps.iter().zip(&self.maps);
        let levels = levels.map(|(map, (size, ..))| Bf16Level { map, size: *size });
        let area: usize = self.maps.iter().map(|it| it.0[0] * it.0[1]).sum();
        let mut out = vec![f32::NAN; bank.filters(panels.clone()).len() * area];
        bank.correlate(panels, levels, &mut out);
        out
    }

    fn readable(&self) -> Vec<f32> {
        let bank = Bf16Bank::readable(&self.templates());
        self.responses(&bank, 0..bank.n_panels())
    }
}

/// The machine's own, or none, which is printed.
#[expect(clippy::print_stdout, reason = "the test prints what was not checked")]
fn amx() -> Option<Amx> {
    let amx = Amx::detect();
    if let Err(why) = amx {
        println!("only the readable version was checked: {why}");
    }
    amx.ok()
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|it| it.to_bits()).collect()
}

/// A size of filters, and how many there are.
fn filters() -> impl Strategy<Value = ([usize; 2], usize)> {
    let side = 1..sized(8, 4);
    ([side.clone(), side], 1..sized(70, 3))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(sized(40, 1) as u32))]

    /// Up to 70 columns and 140 filters of mixed sizes, so that every remainder occurs; values so small
    /// and so large that products and sums leave what numbers can hold at both ends.
    #[test]
    fn the_matrix_unit_gives_the_bits_of_the_readable_version(
        sizes in prop::collection::vec([1..sized(9, 3), 1..sized(70, 5)], 1..sized(4, 2)),
        filters in prop::collection::vec(filters(), 1..sized(3, 2)),
        spread in prop::sample::select(vec![0, 8, 70]),
        seed in any::<u64>(),
    ) {
        let problem = Problem::new(&filters, &sizes, seed).spread(spread, seed);
        let want = problem.readable();
        if let Some(amx) = amx() {
            let bank = Bf16Bank::new(amx, &problem.templates());
            let got = problem.responses(&bank, 0..bank.n_panels());
            prop_assert!(bits(&got) == bits(&want));
        }
    }

    #[test]
    fn responses_keep_the_documented_error_bound(
        size in [1..sized(9, 3), 1..sized(12, 4)],
        (filter, _) in filters(),
        spread in prop::sample::select(vec![0, 8]),
        seed in any::<u64>(),
    ) {
        let problem = Problem::new(&[(filter, 2)], &[size], seed).spread(spread, seed);
        let share = share_of_bound(&problem);
        prop_assert!(share <= 1.0, "{share}");
    }

    #[test]
    fn values_are_rounded_to_the_nearest_with_eight_bits(bits: u32) {
        let value = f32::from_bits(bits);
        prop_assume!(value.is_finite());
        let [low, high] = [bits >> 16, (bits >> 16) + 1];
        let off = |it: u32| (f64::from(f32::from_bits(it << 16)) - f64::from(value)).abs();
        let got = u32::from(rounded(value));
        // The one above the largest number stands for an infinity that is as far away.
        prop_assume!(f32::from_bits(high << 16).is_finite());
        let want = match off(low).total_cmp(&off(high)) {
            std::cmp::Ordering::Less => low,
            std::cmp::Ordering::Greater => high,
            std::cmp::Ordering::Equal => low + low % 2,
        };
        prop_assert_eq!(got, want);
    }
}

/// The largest share of the bound of [`Bf16Bank::correlate`].
fn share_of_bound(problem: &Problem) -> f64 {
    let got = problem.readable();
    let bank = Bf16Bank::readable(&problem.templates());
    let mut got = got.iter();
    let mut largest = 0.0_f64;
    for (size, map, cells) in &problem.maps {
        let cells: Vec<_> = cells.iter().map(|&it| f64::from(it)).collect();
        let absolute: Vec<_> = cells.iter().map(|it| it.abs()).collect();
        for template in problem.templates() {
            let weights: Vec<_> = template.weights.iter().map(|it| it.abs()).collect();
            let sizes = |weights| Template {
                weights,
                ..template
            };
            let want = correlate_f64(template, *map, &cells, *size);
            let sums = correlate_f64(sizes(&weights), *map, &absolute, *size);
            for ((want, sum), got) in want.iter().zip(sums).zip(&mut got) {
                let bound = bank.error_factor(0) * sum;
                largest = largest.max((f64::from(*got) - want).abs() / bound);
            }
        }
    }
    assert!(got.next().is_none(), "all were compared");
    largest
}

/// A bound for the worst case is far from what noise does, but not farther than this.
#[test]
fn the_error_bound_is_not_far_too_large() {
    let [one, many] = [[1, 1], [5, 5]].map(|filter| {
        let problem = Problem::new(&[(filter, sized(8, 2))], &[[sized(24, 3); 2]], 7);
        share_of_bound(&problem)
    });
    assert!(one > 0.1 && many > 0.02, "{one} {many}");
}

/// Weights and cells that tell the order of the sum: any other gives another value.
#[test]
fn even_and_odd_channels_are_summed_separately() {
    let mut weights = vec![0.0; N_CHANNELS];
    let mut cells = vec![0.0; N_CHANNELS];
    let large = 2.0_f64.powi(24);
    for (k, weight) in [(0, large), (1, 1.0), (2, 1.0), (3, 1.0), (4, -large)] {
        weights[k] = weight;
        cells[k] = 1.0;
    }
    let problem = Problem {
        filters: vec![([1, 1], weights)],
        maps: vec![([1, 1], [1, 1], cells)],
    };
    // The 1 of channel 2 is lost beside 2^24; those of channels 1 and 3 never meet it.
    assert_eq!(problem.readable(), [2.0]);
    if let Some(amx) = amx() {
        let bank = Bf16Bank::new(amx, &problem.templates());
        assert_eq!(problem.responses(&bank, 0..1), [2.0]);
    }
}

#[test]
fn responses_do_not_depend_on_what_is_computed_together() {
    let sizes = [[7, 9], [1, 1], [21, 30], [2, 50]];
    let filters = [([5, 5], sized(70, 2)), ([6, 4], sized(3, 1))];
    let problem = Problem::new(&filters, &sizes[..sized(4, 2)], 3);
    let templates = problem.templates();
    let bank = amx().map_or_else(
        || Bf16Bank::readable(&templates),
        |it| Bf16Bank::new(it, &templates),
    );
    let together = problem.responses(&bank, 0..bank.n_panels());
    let n = problem.filters.len();
    for panel in 0..bank.n_panels() {
        let filters = bank.filters(panel..panel + 1);
        let alone = problem.responses(&bank, panel..panel + 1);
        let (mut alone, mut together) = (&alone[..], &together[..]);
        for (size, ..) in &problem.maps {
            let area = size[0] * size[1];
            let want = together.split_off(..n * area).unwrap();
            let got = alone.split_off(..filters.len() * area).unwrap();
            assert!(got == &want[filters.start * area..filters.end * area]);
        }
    }
}
