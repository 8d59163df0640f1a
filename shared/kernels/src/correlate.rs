//! Responses of many filters on feature maps. Most of the arithmetic of a search is done here.

mod points;
mod reference;
mod sums;
#[cfg(test)]
mod tests;
mod winograd;

use std::ops::Range;

use crate::N_CHANNELS;
use crate::isa::Isa;
use crate::simd::{Kernel, ROW, Row, Simd};
use sums::{Stretch, Sums, put, sums};
use winograd::{Answer, Form, Pending};

pub use reference::correlate_f64;

/// Maximum number of filters in a panel.
const N_LANES: usize = ROW;
/// The available forms of tiles, each given by its number of pairs of interpolation points, in ascending order.
const FORMS: [usize; 2] = [3, 4];
/// Sides of the filters for which tiles are available, in cells.
const TILED_SIDES: std::ops::RangeInclusive<usize> = 3..=6;

/// A template over feature cells, as passed to [`FilterBank::new`].
#[derive(Debug, Clone, Copy)]
pub struct Template<'a> {
    /// Height in cells.
    pub rows: usize,
    /// Width in cells.
    pub cols: usize,
    /// Weights, `rows x cols x N_CHANNELS`; the channel varies fastest, then the column.
    pub weights: &'a [f64],
}

/// A padded feature map, `rows x cols x N_CHANNELS`; the channel varies fastest, then the column.
#[derive(Debug, Clone, Copy)]
pub struct FeatureMap<'a> {
    /// Height in cells.
    pub rows: usize,
    /// Width in cells.
    pub cols: usize,
    /// Features of all cells.
    pub cells: &'a [f32],
}

/// A feature map and the number of positions at which filters are evaluated.
#[derive(Debug, Clone, Copy)]
pub struct Level<'a> {
    /// The feature map.
    pub map: FeatureMap<'a>,
    /// Size `[rows, cols]` of every response map.
    pub size: [usize; 2],
}

/// Filters in single precision, laid out for [`correlate`](Self::correlate).
#[derive(Debug, Clone)]
pub struct FilterBank {
    isa: Isa,
    panels: Vec<Panel>,
}

/// Consecutive filters of the same size.
#[derive(Debug, Clone)]
struct Panel {
    filters: Range<usize>,
    /// Size `[rows, cols]` of a filter.
    filter: [usize; 2],
    /// Weights, `rows x cols x N_CHANNELS`, with one filter in each lane and zeros in unused lanes.
    direct: Vec<Row>,
    /// The same weights transformed for each of [`FORMS`], `area x N_CHANNELS`; empty if tiles are not available.
    tiles: [Vec<Row>; FORMS.len()],
}

/// Buffers of [`FilterBank::correlate`], reused from call to call.
#[derive(Debug, Default)]
pub struct CorrelateWorkspace {
    pending: [Pending; FORMS.len()],
    row: Vec<Row>,
}

/// The method by which the responses of a level are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Method {
    /// Computes the sums of the definition directly.
    Direct,
    /// Computes tiles; the value is an index into [`FORMS`].
    Tiles(usize),
}

impl FilterBank {
    /// Packs `filters`, rounding their weights to single precision.
    ///
    /// # Panics
    ///
    /// Panics if a template has no cells, or the number of its weights does not match its size.
    pub fn new(isa: Isa, filters: &[Template<'_>]) -> Self {
        Self::pack(isa, filters, true)
    }

    /// Returns the same as [`Self::new`], but all responses are computed by the definition: slower, for comparison.
    ///
    /// # Panics
    ///
    /// Panics like [`Self::new`].
    pub fn direct(isa: Isa, filters: &[Template<'_>]) -> Self {
        Self::pack(isa, filters, false)
    }

    fn pack(isa: Isa, filters: &[Template<'_>], tiled: bool) -> Self {
        let mut panels: Vec<Panel> = Vec::new();
        for (index, filter) in filters.iter().enumerate() {
            let n_taps = filter.rows * filter.cols * N_CHANNELS;
            assert!(n_taps > 0, "a filter has cells");
            assert_eq!(
                filter.weights.len(),
                n_taps,
                "a filter must have one weight per channel of a cell"
            );
            let size = [filter.rows, filter.cols];
            match panels.last_mut() {
                Some(last) if last.filter == size && last.filters.len() < N_LANES => {
                    last.push(filter.weights);
                }
                _ => {
                    let mut panel = Panel::new(index, size, tiled);
                    panel.push(filter.weights);
                    panels.push(panel);
                }
            }
        }
        Self { isa, panels }
    }

    /// Number of panels, which [`Self::correlate`] can compute separately.
    pub fn n_panels(&self) -> usize {
        self.panels.len()
    }

    /// Indices of the filters in some panels.
    ///
    /// # Panics
    ///
    /// Panics if there are no such panels.
    pub fn filters(&self, panels: Range<usize>) -> Range<usize> {
        let panels = &self.panels[panels];
        let first = panels.first().map_or(0, |panel| panel.filters.start);
        first..panels.last().map_or(0, |panel| panel.filters.end)
    }

    /// Reserves memory for levels with up to `cols` placements in a row. Afterwards, [`Self::correlate`] does not allocate.
    pub fn reserve(&self, cols: usize, workspace: &mut CorrelateWorkspace) {
        for panel in &self.panels {
            for (it, pending) in workspace.pending.iter_mut().enumerate() {
                if !panel.tiles[it].is_empty() {
                    pending.prepare(&Form::new(FORMS[it], panel.filter));
                }
            }
        }
        make_room(&mut workspace.row, cols);
    }

    /// Writes the responses of the filters of some panels on some levels.
    ///
    /// `out[l][f][y][x] = sum over rows r, columns c, channels k of map_l[y + r][x + c][k] w_f[r][c][k]`
    ///
    /// The error is at most `c * sum over k of max |map_l[..][..][k]| * sum over r, c of |w_f[r][c][k]|`. The maximum is taken over the
    /// cells that are less than 10 cells away from those under the filter, and `c` is [`Self::error_factor`]. Filters with sides of 3 to 6
    /// cells are evaluated for a whole tile of the map at once (Winograd). Other filters, and those on very small maps, are evaluated by
    /// the definition. The choice of the method depends only on the sizes. Every response is summed in the same order, whatever other
    /// responses are requested and whatever the instruction set is, so its bits are always the same.
    ///
    /// * `out`: `levels x filters x rows x cols`, without gaps; overwritten.
    /// * Does not allocate if `workspace` has been used before or has enough [memory](Self::reserve).
    ///
    /// # Panics
    ///
    /// Panics if a map is too small for its placements, or the lengths do not match.
    #[expect(
        single_use_lifetimes,
        reason = "an argument of type `impl Trait` cannot do without a name"
    )]
    pub fn correlate<'a>(
        &self,
        panels: Range<usize>,
        levels: impl Iterator<Item = Level<'a>> + Clone,
        out: &mut [f32],
        workspace: &mut CorrelateWorkspace,
    ) {
        let n_filters = self.filters(panels.clone()).len();
        let panels = &self.panels[panels];
        let mut n = 0;
        for Level { map, size } in levels.clone() {
            assert_eq!(
                map.cells.len(),
                map.rows * map.cols * N_CHANNELS,
                "full feature map"
            );
            let room = |filter: [usize; 2]| {
                size[0] + filter[0] <= map.rows + 1 && size[1] + filter[1] <= map.cols + 1
            };
            assert!(
                panels.iter().all(|panel| room(panel.filter)),
                "all placements lie on the map"
            );
            n += n_filters * size[0] * size[1];
        }
        assert_eq!(out.len(), n, "there must be one map per level and filter");
        workspace.pending.iter_mut().for_each(Pending::clear);
        self.isa.run(Correlate {
            panels,
            n_filters,
            levels,
            out,
            workspace,
        });
    }

    /// Error bound of a response of [`Self::correlate`], as the factor in its formula.
    ///
    /// Let `u = 2^-24`, and let `N` be the largest number of roundings between an input and a response. Each added product then has a
    /// relative error of at most `(1 + u)^N - 1 <= N u / (1 - N u)` (Higham, *Accuracy and Stability of Numerical Algorithms*, 2nd ed.,
    /// §3.1). The direct sum has one rounding per product and one for the weight. In a tile, the sums of absolute products are larger by a
    /// factor that follows from the matrices; the factor applies once per axis.
    pub fn error_factor(&self, panel: usize, size: [usize; 2]) -> f64 {
        let filter = self.panels[panel].filter;
        let (roundings, growth) = match self.panels[panel].method(size) {
            Method::Direct => (filter[0] * filter[1] * N_CHANNELS + 1, 1.0),
            Method::Tiles(form) => {
                let points = Form::new(FORMS[form], filter).points;
                let growth = filter.map(|side| points.amplification(side));
                (points.roundings() + N_CHANNELS, growth[0] * growth[1])
            }
        };
        let relative = roundings as f64 * f64::from(f32::EPSILON) / 2.0;
        relative / (1.0 - relative) * growth
    }
}

impl Panel {
    fn new(first: usize, filter: [usize; 2], tiled: bool) -> Self {
        let n_taps = filter[0] * filter[1] * N_CHANNELS;
        let tiled = tiled && filter.iter().all(|side| TILED_SIDES.contains(side));
        let rows = |i: usize| {
            let area = if tiled {
                Form::new(FORMS[i], filter).area()
            } else {
                0
            };
            vec![Row::ZERO; area * N_CHANNELS]
        };
        Self {
            filters: first..first,
            filter,
            direct: vec![Row::ZERO; n_taps],
            tiles: std::array::from_fn(rows),
        }
    }

    /// Chooses the cheapest method from the number of products and the cost per tile.
    fn method(&self, size: [usize; 2]) -> Method {
        let mut best = (self.direct.len() * size[0] * size[1], Method::Direct);
        for (it, n_pairs) in FORMS.into_iter().enumerate() {
            if !self.tiles[it].is_empty() {
                let form = Form::new(n_pairs, self.filter);
                let [down, across] = form.tiles(size);
                let cost = form.area() * (N_CHANNELS + TRANSFORMS) * down * across;
                if cost < best.0 {
                    best = (cost, Method::Tiles(it));
                }
            }
        }
        best.1
    }

    fn push(&mut self, weights: &[f64]) {
        let lane = self.filters.len();
        self.filters.end += 1;
        for (row, weight) in self.direct.iter_mut().zip(weights) {
            row.0[lane] = *weight as f32;
        }
        for (n_pairs, rows) in FORMS.into_iter().zip(&mut self.tiles) {
            if !rows.is_empty() {
                let transformed = Form::new(n_pairs, self.filter).of_filter(self.filter, weights);
                for (row, weight) in rows.iter_mut().zip(transformed) {
                    row.0[lane] = weight as f32;
                }
            }
        }
    }
}

/// Estimated cost of transforming a value there and back, expressed as a number of products; only used to choose a method.
const TRANSFORMS: usize = 10;

struct Correlate<'a, I> {
    panels: &'a [Panel],
    /// Number of filters in all panels.
    n_filters: usize,
    levels: I,
    out: &'a mut [f32],
    workspace: &'a mut CorrelateWorkspace,
}

impl<'a, I: Iterator<Item = Level<'a>> + Clone> Kernel for Correlate<'_, I> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let first_filter = self.panels.first().map_or(0, |panel| panel.filters.start);
        for panels in self.panels.chunk_by(|a, b| a.filter == b.filter) {
            let forms = FORMS.map(|form| Form::new(form, panels[0].filter));
            let mut at = 0;
            for level in self.levels.clone() {
                let place = (at, level.size);
                at += self.n_filters * level.size[0] * level.size[1];
                match panels[0].method(level.size) {
                    Method::Direct => {
                        let out = &mut self.out[place.0..];
                        let row = &mut self.workspace.row;
                        direct(simd, (panels, first_filter), level, out, row);
                    }
                    Method::Tiles(it) => {
                        let mut answer = Answer::new(&forms, it, (panels, first_filter), self.out);
                        let pending = &mut self.workspace.pending[it];
                        winograd::take(simd, pending, &mut answer, level.map, place);
                    }
                }
            }
            for (it, pending) in self.workspace.pending.iter_mut().enumerate() {
                let mut answer = Answer::new(&forms, it, (panels, first_filter), self.out);
                winograd::flush(simd, pending, &mut answer);
            }
        }
    }
}

/// Computes all responses of a level by the definition.
#[inline(always)]
fn direct<S: Simd>(
    simd: S,
    (panels, first_filter): (&[Panel], usize),
    Level { map, size }: Level<'_>,
    out: &mut [f32],
    row: &mut Vec<Row>,
) {
    let plane = size[0] * size[1];
    let (cells, _) = map.cells.as_chunks::<N_CHANNELS>();
    make_room(row, size[1]);
    for panel in panels {
        for y in 0..size[0] {
            for block in blocks(size[1], S::BLOCK) {
                let job = Sums {
                    cells: &cells[y * map.cols + block.start..],
                    stride: map.cols,
                    filter_cols: panel.filter[1],
                    weights: &panel.direct,
                };
                sums(simd, block.len(), &job, &mut row[block]);
            }
            let to = Stretch {
                at: (panel.filters.start - first_filter) * plane + y * size[1],
                plane,
                n_filters: panel.filters.len(),
            };
            put(simd, row, size[1], to, out);
        }
    }
}

/// Makes a buffer long enough for a row of cells, and for reading whole registers at its end.
fn make_room(row: &mut Vec<Row>, cols: usize) {
    row.resize(row.len().max(cols + N_LANES), Row::ZERO);
}

/// Splits `total` cells into blocks of at most `largest` cells, with sizes as equal as possible.
#[inline(always)]
fn blocks(total: usize, largest: usize) -> impl Iterator<Item = Range<usize>> {
    let n = total.div_ceil(largest);
    (0..n).map(move |i| i * total / n..(i + 1) * total / n)
}
