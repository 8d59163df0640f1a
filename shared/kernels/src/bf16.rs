//! Responses of many filters with cells and weights rounded to bfloat16: less exact, and many times
//! as fast on a machine with tile products.

mod fast;
mod reference;
#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::N_CHANNELS;
use crate::amx::Amx;
use crate::correlate::{FeatureMap, Template};
use crate::dispatch::{Body, dispatch};
use crate::isa::Isa;
use crate::simd::ROW;
use crate::tiles::{BLOCK, Cell, SIDE, Weights};

/// Most filters in a panel: two tiles of them.
const N_LANES: usize = ROW;

/// The nearest bfloat16, the even one of two that are equally near.
///
/// Infinities stay; what is not a number may become another such.
#[inline(always)]
fn rounded(value: f32) -> u16 {
    let bits = value.to_bits();
    ((bits + 0x7FFF + (bits >> 16 & 1)) >> 16) as u16
}

/// A padded feature map whose values are rounded to bfloat16.
#[derive(Debug, Default)]
pub struct Bf16Map {
    rows: usize,
    cols: usize,
    /// `rows x cols`, and [`BLOCK`] more, since blocks are read whole.
    cells: Vec<Cell>,
}

impl Bf16Map {
    /// Takes over a map, every value rounded to the nearest bfloat16, ties to the even one.
    ///
    /// # Panics
    ///
    /// If the number of values of `map` does not match its size.
    pub fn round(&mut self, isa: Isa, map: FeatureMap<'_>) {
        let (cells, rest) = map.cells.as_chunks::<N_CHANNELS>();
        assert!(
            rest.is_empty() && cells.len() == map.rows * map.cols,
            "full feature map"
        );
        [self.rows, self.cols] = [map.rows, map.cols];
        self.cells
            .resize(cells.len() + BLOCK, Cell([0; N_CHANNELS]));
        dispatch(
            isa,
            Round {
                from: cells,
                to: &mut self.cells,
            },
        );
    }
}

struct Round<'a> {
    from: &'a [[f32; N_CHANNELS]],
    to: &'a mut [Cell],
}

impl Body for Round<'_> {
    #[inline(always)]
    fn run(self) {
        for (to, from) in self.to.iter_mut().zip(self.from) {
            for (to, from) in to.0.iter_mut().zip(from) {
                *to = rounded(*from);
            }
        }
    }
}

/// A rounded feature map and the number of positions at which filters are evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Bf16Level<'a> {
    /// The features.
    pub map: &'a Bf16Map,
    /// Size `[rows, cols]` of every response map.
    pub size: [usize; 2],
}

/// Filters in bfloat16, laid out for [`correlate`](Self::correlate).
#[derive(Debug, Clone)]
pub struct Bf16Bank {
    engine: Engine,
    panels: Vec<Panel>,
}

/// The implementation.
#[derive(Debug, Clone, Copy)]
enum Engine {
    /// The matrix unit; other instructions write its sums to their planes.
    Amx(Amx, Isa),
    /// Plain loops.
    Readable(Isa),
}

/// Consecutive filters of equal size.
#[derive(Debug, Clone)]
struct Panel {
    filters: Range<usize>,
    /// Size `[rows, cols]` of a filter.
    filter: [usize; 2],
    /// One for each filter cell; zero where there is no filter.
    weights: Vec<Weights>,
}

impl Bf16Bank {
    /// Packs `filters`, rounding their weights to single precision and then to bfloat16.
    ///
    /// # Panics
    ///
    /// If a template has no cells, or the number of its weights does not match its size.
    pub fn new(amx: Amx, filters: &[Template<'_>]) -> Self {
        Self::pack(Engine::Amx(amx, Isa::best()), filters)
    }

    /// As [`Self::new`], but plain loops compute: the same bits on any machine, a hundred times slower,
    /// and there to compare with.
    ///
    /// # Panics
    ///
    /// As [`Self::new`].
    pub fn readable(filters: &[Template<'_>]) -> Self {
        Self::pack(Engine::Readable(Isa::best()), filters)
    }

    fn pack(engine: Engine, filters: &[Template<'_>]) -> Self {
        let mut panels: Vec<Panel> = Vec::new();
        for (index, filter) in filters.iter().enumerate() {
            let n_taps = filter.rows * filter.cols * N_CHANNELS;
            assert!(n_taps > 0, "a filter has cells");
            assert_eq!(
                filter.weights.len(),
                n_taps,
                "one weight per channel of a cell"
            );
            let size = [filter.rows, filter.cols];
            let fits = |it: &&mut Panel| it.filter == size && it.filters.len() < N_LANES;
            if let Some(last) = panels.last_mut().filter(fits) {
                last.push(filter.weights);
            } else {
                let mut panel = Panel::new(index, size);
                panel.push(filter.weights);
                panels.push(panel);
            }
        }
        Self { engine, panels }
    }

    /// Number of panels: the pieces that [`Self::correlate`] can be asked for apart.
    pub fn n_panels(&self) -> usize {
        self.panels.len()
    }

    /// The filters of some panels.
    ///
    /// # Panics
    ///
    /// If there are no such panels.
    pub fn filters(&self, panels: Range<usize>) -> Range<usize> {
        let panels = &self.panels[panels];
        let first = panels.first().map_or(0, |it| it.filters.start);
        first..panels.last().map_or(0, |it| it.filters.end)
    }

    /// Writes the responses of the filters of some panels on some levels.
    ///
    /// `out[l][f][y][x] = sum over rows r, columns c, channels k of map_l[y + r][x + c][k] w_f[r][c][k]`
    ///
    /// with `map` and `w` rounded to bfloat16, to within [`Self::error_factor`] times the same sum of
    /// absolute products, as long as no product nor sum of them is closer to zero than `2^-126` without
    /// being it. Every response adds in the same order on whatever machine, which is that of
    /// `TDPBF16PS` (Intel, *Software Developer's Manual*, volume 2): for every filter cell, row by row,
    /// the products of the even channels and those of the odd ones are added up apart, each step rounded
    /// once; then the two sums are added, and this to the sum of the filter cells before it. What is
    /// closer to zero than `2^-126` counts as zero, before and after every step.
    ///
    /// * `out`: `levels x filters x rows x cols`, without gaps; overwritten.
    /// * Allocates nothing.
    ///
    /// # Panics
    ///
    /// If a map is too small for its placements, or the lengths disagree.
    #[expect(
        single_use_lifetimes,
        reason = "an argument of type `impl Trait` cannot do without a name"
    )]
    pub fn correlate<'a>(
        &self,
        panels: Range<usize>,
        levels: impl Iterator<Item = Bf16Level<'a>> + Clone,
        out: &mut [f32],
    ) {
        let n_filters = self.filters(panels.clone()).len();
        let panels = &self.panels[panels];
        let mut n = 0;
        for Bf16Level { map, size } in levels.clone() {
            let room = |filter: [usize; 2]| {
                size[0] + filter[0] <= map.rows + 1 && size[1] + filter[1] <= map.cols + 1
            };
            assert!(
                panels.iter().all(|it| room(it.filter)),
                "all placements lie on the map"
            );
            n += n_filters * size[0] * size[1];
        }
        assert_eq!(out.len(), n, "one map per level and filter");
        match self.engine {
            Engine::Amx(amx, isa) => fast::correlate((amx, isa), panels, levels, out),
            Engine::Readable(isa) => reference::correlate(isa, panels, levels, out),
        }
    }

    /// How far from the exact sum of unrounded values a response of [`Self::correlate`] can be, as the
    /// factor in its bound.
    ///
    /// A cell and a weight are each off by a factor `1 + 2^-8` at most where they become bfloat16, the
    /// weight by another `1 + u`, `u = 2^-24`, where it becomes single precision; a product then goes
    /// through at most 16 steps of its sum, one where even and odd meet, and one for each filter cell
    /// (Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed., §3.1).
    pub fn error_factor(&self, panel: usize) -> f64 {
        let [rows, cols] = self.panels[panel].filter;
        let steps = N_CHANNELS / 2 + 1 + rows * cols;
        let single = f64::from(f32::EPSILON) / 2.0;
        let inputs = (1.0 + 2.0_f64.powi(-8)).powi(2);
        inputs * (1.0 + single).powi(steps as i32 + 1) - 1.0
    }
}

impl Panel {
    fn new(first: usize, filter: [usize; 2]) -> Self {
        let nothing = Weights([[[[0; 2]; SIDE]; SIDE]; 2]);
        Self {
            filters: first..first,
            filter,
            weights: vec![nothing; filter[0] * filter[1]],
        }
    }

    fn push(&mut self, weights: &[f64]) {
        let lane = self.filters.len();
        self.filters.end += 1;
        let (cells, _) = weights.as_chunks::<N_CHANNELS>();
        for (to, cell) in self.weights.iter_mut().zip(cells) {
            for (k, weight) in cell.iter().enumerate() {
                to.0[lane / SIDE][k / 2][lane % SIDE][k % 2] = rounded(*weight as f32);
            }
        }
    }
}
