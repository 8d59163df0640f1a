//! Responses of many filters on one feature map: the bulk of the arithmetic.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod reference;

use std::ops::Range;

use crate::N_CHANNELS;
use crate::isa::{Isa, Kind};

pub use reference::correlate_f64;

/// Most filters in a panel.
const PANEL: usize = 32;

/// A template over feature cells, as it is offered to [`FilterBank::new`].
#[derive(Debug, Clone, Copy)]
pub struct Template<'a> {
    /// Height, cells.
    pub rows: usize,
    /// Width, cells.
    pub cols: usize,
    /// `rows x cols x N_CHANNELS` weights, channel fastest, then column.
    pub weights: &'a [f64],
}

/// A padded feature map, `rows x cols x N_CHANNELS`, channel fastest, then column.
#[derive(Debug, Clone, Copy)]
pub struct FeatureMap<'a> {
    /// Height, cells.
    pub rows: usize,
    /// Width, cells.
    pub cols: usize,
    /// The features.
    pub cells: &'a [f32],
}

/// Filters in single precision, laid out for [`correlate`](Self::correlate).
#[derive(Debug, Clone)]
pub struct FilterBank {
    isa: Isa,
    panels: Vec<Panel>,
}

/// Consecutive filters of equal size.
#[derive(Debug, Clone)]
struct Panel {
    filters: Range<usize>,
    rows: usize,
    cols: usize,
    /// `rows x cols x N_CHANNELS x PANEL`, filter fastest; zero where there is no filter.
    weights: Vec<f32>,
}

impl FilterBank {
    /// Packs `filters`, rounding their weights to single precision.
    ///
    /// # Panics
    ///
    /// If a template has no cells or another number of weights than its size says.
    pub fn new(isa: Isa, filters: &[Template<'_>]) -> Self {
        let mut panels: Vec<Panel> = Vec::new();
        for (index, filter) in filters.iter().enumerate() {
            let n_taps = filter.rows * filter.cols * N_CHANNELS;
            assert!(n_taps > 0, "a filter has cells");
            assert_eq!(
                filter.weights.len(),
                n_taps,
                "one weight per channel of a cell"
            );
            let fits = panels.last().is_some_and(|it| {
                [it.rows, it.cols] == [filter.rows, filter.cols] && it.filters.len() < PANEL
            });
            if !fits {
                panels.push(Panel {
                    filters: index..index,
                    rows: filter.rows,
                    cols: filter.cols,
                    weights: vec![0.0; n_taps * PANEL],
                });
            }
            if let Some(panel) = panels.last_mut() {
                let lane = panel.filters.len();
                panel.filters.end = index + 1;
                let lanes = panel.weights[lane..].iter_mut().step_by(PANEL);
                for (packed, weight) in lanes.zip(filter.weights) {
                    *packed = *weight as f32;
                }
            }
        }
        Self { isa, panels }
    }

    /// Number of panels: the pieces that [`Self::correlate`] can be asked for apart.
    pub fn n_panels(&self) -> usize {
        self.panels.len()
    }

    /// The filters of a panel.
    pub fn filters(&self, panel: usize) -> Range<usize> {
        self.panels[panel].filters.clone()
    }

    /// Writes the responses of one panel's filters.
    ///
    /// `out[f][y][x] = sum over rows r, columns c, channels k of map[y + r][x + c][k] w_f[r][c][k]`,
    /// added in this order, each product with a fused multiply-add: the same bits on every
    /// instruction set.
    ///
    /// * `out`: `filters x rows x cols`; overwritten.
    ///
    /// # Panics
    ///
    /// If the map is too small for `rows x cols` placements, or the lengths disagree.
    pub fn correlate(&self, panel: usize, map: FeatureMap<'_>, size: [usize; 2], out: &mut [f32]) {
        let panel = &self.panels[panel];
        let [rows, cols] = size;
        assert_eq!(
            out.len(),
            panel.filters.len() * rows * cols,
            "one map per filter"
        );
        assert_eq!(
            map.cells.len(),
            map.rows * map.cols * N_CHANNELS,
            "full feature map"
        );
        assert!(
            rows + panel.rows <= map.rows + 1 && cols + panel.cols <= map.cols + 1,
            "all placements lie on the map"
        );
        match self.isa.0 {
            Kind::Portable => reference::correlate(panel, map, size, out),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Isa` of this kind only exists where AVX2 and FMA were detected.
            Kind::Avx2 => unsafe { avx2::correlate(panel, map, size, out) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: an `Isa` of this kind only exists where AVX-512 F and VL were detected.
            Kind::Avx512 => unsafe { avx512::correlate(panel, map, size, out) },
        }
    }
}

/// Splits `total` cells into blocks of at most `largest`, as equal as they can be.
fn blocks(total: usize, largest: usize) -> impl Iterator<Item = Range<usize>> {
    let n = total.div_ceil(largest);
    (0..n).map(move |it| it * total / n..(it + 1) * total / n)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Numbers in -1..1 that look random and depend on the seed only.
    fn noise(seed: u64, n: usize) -> Vec<f64> {
        let mut state = seed.wrapping_mul(2654435761) | 1;
        std::iter::repeat_with(|| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1_u64 << 23) as f64 - 1.0
        })
        .take(n)
        .collect()
    }

    fn all_responses(bank: &FilterBank, map: FeatureMap<'_>, size: [usize; 2]) -> Vec<Vec<f32>> {
        let panel = |it| {
            let mut out = vec![f32::NAN; bank.filters(it).len() * size[0] * size[1]];
            bank.correlate(it, map, size, &mut out);
            out
        };
        (0..bank.n_panels()).map(panel).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// Up to 70 columns and 70 filters of mixed sizes, so that every remainder occurs.
        #[test]
        fn every_instruction_set_gives_the_same_bits(
            cols in 1..70_usize,
            rows in 1..4_usize,
            sizes in prop::collection::vec((1..4_usize, 1..4_usize, 1..35_usize), 1..4),
            seed in any::<u64>(),
        ) {
            let filters: Vec<_> = sizes
                .iter()
                .flat_map(|&(rows, cols, n)| std::iter::repeat_n((rows, cols), n))
                .enumerate()
                .map(|(it, (r, c))| (r, c, noise(seed ^ it as u64, r * c * N_CHANNELS)))
                .collect();
            let templates: Vec<_> = filters
                .iter()
                .map(|(rows, cols, weights)| Template { rows: *rows, cols: *cols, weights })
                .collect();
            let (map_rows, map_cols) = (rows + 3, cols + 3);
            let cells = noise(!seed, map_rows * map_cols * N_CHANNELS);
            let cells: Vec<_> = cells.iter().map(|&it| it as f32).collect();
            let map = FeatureMap { rows: map_rows, cols: map_cols, cells: &cells };
            let all = Isa::available();
            let want = all_responses(&FilterBank::new(all[0], &templates), map, [rows, cols]);
            for isa in all {
                let bank = FilterBank::new(isa, &templates);
                prop_assert_eq!(&all_responses(&bank, map, [rows, cols]), &want, "{:?}", isa);
            }
            let cells: Vec<_> = cells.iter().map(|&it| f64::from(it)).collect();
            for (filter, got) in templates.iter().zip(want.concat().chunks(rows * cols)) {
                let want = correlate_f64(*filter, [map_rows, map_cols], &cells, [rows, cols]);
                for (want, got) in want.iter().zip(got) {
                    prop_assert!((want - f64::from(*got)).abs() < 1e-4);
                }
            }
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
        let cells: Vec<_> = (0..4 * 5 * N_CHANNELS).map(|it| it as f32).collect();
        let map = FeatureMap {
            rows: 4,
            cols: 5,
            cells: &cells,
        };
        let mut out = [f32::NAN; 9];
        bank.correlate(0, map, [3, 3], &mut out);
        for (at, got) in out.iter().enumerate() {
            let (y, x) = (at / 3 + 1, at % 3 + 2);
            assert_eq!(*got, 2.0 * cells[(y * 5 + x) * N_CHANNELS + 7]);
        }
    }

    #[test]
    fn blocks_cover_everything_once_and_evenly() {
        for total in 0..70 {
            let all: Vec<_> = blocks(total, 14).collect();
            assert!(all.iter().all(|it| (1..=14).contains(&it.len())));
            assert_eq!(
                all.into_iter().flatten().collect::<Vec<_>>(),
                (0..total).collect::<Vec<_>>()
            );
        }
    }
}
