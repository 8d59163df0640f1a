//! Computes the responses of a whole tile with fewer products than the definition needs.
#![expect(
    clippy::needless_range_loop,
    reason = "only loops over ranges are always unrolled, which keeps lines in registers: 2.5 times as fast"
)]

use std::ops::Range;

use super::points::{MAX_TILE, Points};
use super::sums::{Stretch, Sums, put, sums};
use super::{FeatureMap, N_LANES, Panel, blocks};
use crate::N_CHANNELS;
use crate::simd::{Row, Simd};

/// Number of tiles that are transformed, multiplied and transformed back together.
const TILES: usize = 24;
/// Number of neighbouring tiles whose responses are gathered before they are written.
const GATHERED: usize = 8;

/// A form of tiles for filters of one size.
#[derive(Debug, Clone)]
pub(super) struct Form {
    pub(super) points: Points,
    /// Number of placements `[rows, cols]` covered by a tile.
    pub(super) placements: [usize; 2],
}

impl Form {
    /// Makes a form with tiles of `2 n_pairs + 2` cells along each side.
    pub(super) fn new(n_pairs: usize, filter: [usize; 2]) -> Self {
        let points = Points::new(n_pairs);
        let placements = filter.map(|side| points.tile() + 1 - side);
        Self { points, placements }
    }

    /// Number of values in a transformed tile.
    pub(super) fn area(&self) -> usize {
        self.points.tile().pow(2)
    }

    /// Number of tiles down and across that cover all placements of `size`.
    pub(super) fn tiles(&self, size: [usize; 2]) -> [usize; 2] {
        [0, 1].map(|i| size[i].div_ceil(self.placements[i]))
    }

    /// `G w G^T` for every channel of a filter, `area x N_CHANNELS`, in double precision.
    ///
    /// * `weights`: `filter rows x filter cols x N_CHANNELS`.
    pub(super) fn of_filter(&self, [rows, cols]: [usize; 2], weights: &[f64]) -> Vec<f64> {
        let [down, across] = [rows, cols].map(|side| self.points.of_filter(side));
        let value = |a: usize, b: usize, k: usize| -> f64 {
            let row = |r: usize| -> f64 {
                let taps = weights[r * cols * N_CHANNELS + k..].iter();
                let taps = taps.step_by(N_CHANNELS).zip(&across[b]);
                taps.map(|(w, g)| w * g).sum()
            };
            (0..rows).map(|r| down[a][r] * row(r)).sum()
        };
        let n = self.points.tile();
        (0..n * n * N_CHANNELS)
            .map(|i| (i / N_CHANNELS / n, i / N_CHANNELS % n, i % N_CHANNELS))
            .map(|(a, b, k)| value(a, b, k))
            .collect()
    }
}

/// Position to which the responses of a tile are written.
#[derive(Debug, Clone, Copy)]
struct Tile {
    /// First index of the level's maps.
    level: usize,
    /// Size `[rows, cols]` of a map.
    size: [usize; 2],
    y: usize,
    x: usize,
}

/// Tiles collected for the next computation, and the buffers for them.
#[derive(Debug, Default)]
pub(super) struct Pending {
    tiles: Vec<Tile>,
    /// Transformed cells, `area x TILES`.
    cells: Vec<Row>,
    /// Products of one panel, `area x TILES`.
    products: Vec<Row>,
    /// A tile between its two passes.
    between: Vec<Row>,
    /// Responses of [`GATHERED`] tiles, `placements x columns`.
    gathered: Vec<Row>,
}

impl Pending {
    /// Removes tiles that were left by an earlier panic.
    pub(super) fn clear(&mut self) {
        self.tiles.clear();
    }

    /// Allocates the buffers; later calls do nothing.
    pub(super) fn prepare(&mut self, form: &Form) {
        let [rows, cols] = form.placements;
        self.tiles.reserve(TILES.saturating_sub(self.tiles.len()));
        self.cells.resize(form.area() * TILES, Row::ZERO);
        self.products.resize(form.area() * TILES, Row::ZERO);
        self.between.resize(form.area(), Row::ZERO);
        // Whole registers are read, so the last row is followed by one more register.
        let n = rows * cols * GATHERED + N_LANES;
        self.gathered.resize(n.max(self.gathered.len()), Row::ZERO);
    }
}

/// The panels to compute, and the destination.
pub(super) struct Answer<'a> {
    form: &'a Form,
    /// Index of the form in a panel's packed weights.
    form_idx: usize,
    panels: &'a [Panel],
    /// Index of the filter whose map is the first of a level.
    first_filter: usize,
    out: &'a mut [f32],
}

impl<'a> Answer<'a> {
    /// Computes the responses in tiles of one of the forms.
    #[inline(always)]
    pub(super) fn new(
        forms: &'a [Form],
        form_idx: usize,
        (panels, first_filter): (&'a [Panel], usize),
        out: &'a mut [f32],
    ) -> Self {
        Self {
            form: &forms[form_idx],
            form_idx,
            panels,
            first_filter,
            out,
        }
    }
}

/// Adds a level whose maps begin at `level` in the output, and computes when enough tiles are collected.
#[inline(always)]
pub(super) fn take<S: Simd>(
    simd: S,
    pending: &mut Pending,
    answer: &mut Answer<'_>,
    map: FeatureMap<'_>,
    (level, size): (usize, [usize; 2]),
) {
    pending.prepare(answer.form);
    let [rows, cols] = answer.form.placements;
    for y in (0..size[0]).step_by(rows) {
        for x in (0..size[1]).step_by(cols) {
            let slot = pending.tiles.len();
            pending.tiles.push(Tile { level, size, y, x });
            match answer.form.points.n_pairs {
                3 => transform::<S, 3>(simd, &answer.form.points, (map, y, x), pending, slot),
                _ => transform::<S, 4>(simd, &answer.form.points, (map, y, x), pending, slot),
            }
            if pending.tiles.len() == TILES {
                flush(simd, pending, answer);
            }
        }
    }
}

/// Computes the responses of all collected tiles.
#[inline(always)]
pub(super) fn flush<S: Simd>(simd: S, pending: &mut Pending, answer: &mut Answer<'_>) {
    for panel in answer.panels {
        multiply(simd, &panel.tiles[answer.form_idx], pending);
        let mut done = 0;
        while done < pending.tiles.len() {
            let n = neighbours(&pending.tiles[done..], answer.form.placements[1]);
            match answer.form.points.n_pairs {
                3 => write::<S, 3>(simd, pending, done..done + n, panel, answer),
                _ => write::<S, 4>(simd, pending, done..done + n, panel, answer),
            }
            done += n;
        }
    }
    pending.tiles.clear();
}

/// Number of tiles at the start of the list that are next to each other; at most [`GATHERED`].
fn neighbours(tiles: &[Tile], step: usize) -> usize {
    let first = tiles[0];
    let beside = |(nth, tile): &(usize, &Tile)| {
        [tile.level, tile.y, tile.x] == [first.level, first.y, first.x + nth * step]
    };
    let all = tiles.iter().enumerate().take(GATHERED);
    all.take_while(beside).count()
}

/// `B^T d B` for all channels of the tile at `(y, x)`; cells outside the map count as zero.
#[inline(always)]
fn transform<S: Simd, const K: usize>(
    simd: S,
    points: &Points,
    (map, y, x): (FeatureMap<'_>, usize, usize),
    pending: &mut Pending,
    slot: usize,
) {
    let n = 2 * K + 2;
    let (cells, _) = map.cells.as_chunks::<N_CHANNELS>();
    let (rows, cols) = (n.min(map.rows - y), n.min(map.cols - x));
    let mut line = [simd.splat(0.0); MAX_TILE];
    for lane in (0..N_CHANNELS).step_by(S::LANES) {
        for c in 0..n {
            for (r, value) in line.iter_mut().enumerate().take(n) {
                *value = if r < rows && c < cols {
                    simd.load(&cells[(y + r) * map.cols + x + c][lane..])
                } else {
                    simd.splat(0.0)
                };
            }
            let line = of_cells::<S, K>(simd, points, line);
            store_line(simd, (line, n), &mut pending.between[c..], (n, lane));
        }
        for a in 0..n {
            let line = load_line::<S, K>(simd, &pending.between[a * n..][..n], (1, lane));
            let line = of_cells::<S, K>(simd, points, line);
            let to = &mut pending.cells[a * n * TILES + slot..];
            store_line(simd, (line, n), to, (TILES, lane));
        }
    }
}

/// Multiplies a line of cells by `B^T`; see [`Points`].
#[inline(always)]
fn of_cells<S: Simd, const K: usize>(
    simd: S,
    points: &Points,
    line: [S::V; MAX_TILE],
) -> [S::V; MAX_TILE] {
    let mut out = line;
    let (mut even, mut odd) = (line[2 * K], line[2 * K + 1]);
    for j in (0..K).rev() {
        let c = simd.splat(points.whole[j]);
        even = simd.mul_add(c, line[2 * j], even);
        odd = simd.mul_add(c, line[2 * j + 1], odd);
    }
    out[0] = even;
    out[2 * K + 1] = odd;
    for k in 0..K {
        let (mut even, mut odd) = (line[2 * K], line[2 * K - 1]);
        for j in (0..K - 1).rev() {
            let c = simd.splat(points.without[k][j]);
            even = simd.mul_add(c, line[2 * j + 2], even);
            odd = simd.mul_add(c, line[2 * j + 1], odd);
        }
        let p = points.positive[k];
        out[1 + 2 * k] = simd.mul_add(simd.splat(p), odd, even);
        out[2 + 2 * k] = simd.mul_add(simd.splat(-p), odd, even);
    }
    out
}

/// Sums over channels of the products of transformed cells and transformed weights.
#[inline(always)]
fn multiply<S: Simd>(simd: S, weights: &[Row], pending: &mut Pending) {
    let each = weights.chunks_exact(N_CHANNELS);
    let each = each.zip(pending.cells.chunks_exact(TILES));
    let each = each.zip(pending.products.chunks_exact_mut(TILES));
    for ((weights, cells), products) in each {
        for block in blocks(pending.tiles.len(), S::BLOCK) {
            let job = Sums {
                cells: &cells[block.clone()],
                stride: TILES,
                filter_cols: 1,
                weights,
            };
            sums(simd, block.len(), &job, &mut products[block]);
        }
    }
}

/// Computes `A^T m A` of neighbouring tiles for all filters of a panel, and writes the results.
#[inline(always)]
fn write<S: Simd, const K: usize>(
    simd: S,
    pending: &mut Pending,
    tiles: Range<usize>,
    panel: &Panel,
    answer: &mut Answer<'_>,
) {
    let [rows, cols] = answer.form.placements;
    let first = pending.tiles[tiles.start];
    let width = tiles.len() * cols;
    let n_rows = rows.min(first.size[0] - first.y);
    for (it, slot) in tiles.enumerate() {
        for lane in (0..N_LANES).step_by(S::LANES) {
            let points = &answer.form.points;
            down::<S, K>(simd, points, pending, (slot, lane), rows);
            for i in 0..n_rows {
                let at = i * width + it * cols;
                across::<S, K>(simd, points, pending, (i, lane), at..at + cols);
            }
        }
    }
    let plane = first.size[0] * first.size[1];
    let maps = first.level + (panel.filters.start - answer.first_filter) * plane;
    for i in 0..n_rows {
        let to = Stretch {
            at: maps + (first.y + i) * first.size[1] + first.x,
            plane,
            n_filters: panel.filters.len(),
        };
        let n = width.min(first.size[1] - first.x);
        put(simd, &pending.gathered[i * width..], n, to, answer.out);
    }
}

/// The first pass over a tile's products, down its columns.
#[inline(always)]
fn down<S: Simd, const K: usize>(
    simd: S,
    points: &Points,
    pending: &mut Pending,
    (slot, lane): (usize, usize),
    rows: usize,
) {
    let n = 2 * K + 2;
    for b in 0..n {
        let line = load_line::<S, K>(
            simd,
            &pending.products[b * TILES + slot..],
            (n * TILES, lane),
        );
        let values = of_products::<S, K>(simd, points, line, rows);
        store_line(simd, (values, rows), &mut pending.between[b..], (n, lane));
    }
}

/// The second pass, along row `i`.
#[inline(always)]
fn across<S: Simd, const K: usize>(
    simd: S,
    points: &Points,
    pending: &mut Pending,
    (i, lane): (usize, usize),
    to: Range<usize>,
) {
    let n = 2 * K + 2;
    let line = load_line::<S, K>(simd, &pending.between[i * n..][..n], (1, lane));
    let values = of_products::<S, K>(simd, points, line, to.len());
    let to = &mut pending.gathered[to];
    store_line(simd, (values, to.len()), to, (1, lane));
}

/// Multiplies a line of products by `A^T`, for a number of placements; see [`Points`].
#[inline(always)]
fn of_products<S: Simd, const K: usize>(
    simd: S,
    points: &Points,
    line: [S::V; MAX_TILE],
    n: usize,
) -> [S::V; MAX_TILE] {
    match n {
        3 if K == 3 => placements::<S, K, 3>(simd, points, line),
        4 if K == 3 => placements::<S, K, 4>(simd, points, line),
        5 => placements::<S, K, 5>(simd, points, line),
        6 => placements::<S, K, 6>(simd, points, line),
        7 if K == 4 => placements::<S, K, 7>(simd, points, line),
        8 if K == 4 => placements::<S, K, 8>(simd, points, line),
        _ => unreachable!("no filter of 3 to 6 cells has {n} placements on a tile"),
    }
}

#[inline(always)]
fn placements<S: Simd, const K: usize, const N: usize>(
    simd: S,
    points: &Points,
    line: [S::V; MAX_TILE],
) -> [S::V; MAX_TILE] {
    let mut even = line;
    let mut odd = line;
    for k in 0..K {
        let (plus, minus) = (line[1 + 2 * k], line[2 + 2 * k]);
        even[k] = simd.add(plus, minus);
        odd[k] = simd.sub(plus, minus);
    }
    let mut out = line;
    for k in 0..K {
        out[0] = simd.add(out[0], even[k]);
    }
    for i in 1..N {
        let terms = if i % 2 == 0 { even } else { odd };
        out[i] = terms[0];
        for k in 1..K {
            out[i] = simd.mul_add(simd.splat(points.powers[i][k]), terms[k], out[i]);
        }
    }
    out[N - 1] = simd.add(out[N - 1], line[2 * K + 1]);
    out
}

/// Loads the values of a line, `step` rows apart.
#[inline(always)]
fn load_line<S: Simd, const K: usize>(
    simd: S,
    from: &[Row],
    (step, lane): (usize, usize),
) -> [S::V; MAX_TILE] {
    let mut line = [simd.splat(0.0); MAX_TILE];
    for it in 0..2 * K + 2 {
        line[it] = simd.load(&from[it * step].0[lane..]);
    }
    line
}

/// Writes the first `n` values of a line, `step` rows apart.
#[inline(always)]
fn store_line<S: Simd>(
    simd: S,
    (line, n): ([S::V; MAX_TILE], usize),
    to: &mut [Row],
    (step, lane): (usize, usize),
) {
    for it in 0..n {
        simd.store(line[it], &mut to[it * step].0[lane..]);
    }
}
