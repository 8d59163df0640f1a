//! Sums of products of a few cells with 32 filters: the loop that does nearly all the arithmetic.

use std::borrow::Borrow;

use super::N_LANES;
use crate::N_CHANNELS;
use crate::simd::{Row, Simd};

/// The operands of the sums: either a filter over the rows of a map, or transformed tiles with one product per channel.
pub(super) struct Sums<'a, C> {
    /// Cells, starting with the cell under the first filter cell of the first sum.
    pub(super) cells: &'a [C],
    /// Number of cells from one row of the map to the next.
    pub(super) stride: usize,
    /// Number of cells in a row of the filter.
    pub(super) filter_cols: usize,
    /// `filter rows x filter_cols x N_CHANNELS` rows of [`N_LANES`] filters.
    pub(super) weights: &'a [Row],
}

/// Writes the sums at `n` neighbouring cells (1 to `S::BLOCK`); the sums of all filters at a cell are stored together. Each sum starts at
/// zero, and products are added row by row, cell by cell, channel by channel.
#[inline(always)]
pub(super) fn sums<S: Simd, C: Borrow<[f32; N_CHANNELS]>>(
    simd: S,
    n: usize,
    job: &Sums<'_, C>,
    out: &mut [Row],
) {
    for lane in (0..N_LANES).step_by(2 * S::LANES) {
        match n {
            1 => block::<S, C, 1>(simd, job, lane, out),
            2 => block::<S, C, 2>(simd, job, lane, out),
            3 => block::<S, C, 3>(simd, job, lane, out),
            4 => block::<S, C, 4>(simd, job, lane, out),
            5 => block::<S, C, 5>(simd, job, lane, out),
            6 => block::<S, C, 6>(simd, job, lane, out),
            7 if S::BLOCK >= 7 => block::<S, C, 7>(simd, job, lane, out),
            8 if S::BLOCK >= 8 => block::<S, C, 8>(simd, job, lane, out),
            9 if S::BLOCK >= 9 => block::<S, C, 9>(simd, job, lane, out),
            10 if S::BLOCK >= 10 => block::<S, C, 10>(simd, job, lane, out),
            11 if S::BLOCK >= 11 => block::<S, C, 11>(simd, job, lane, out),
            12 if S::BLOCK >= 12 => block::<S, C, 12>(simd, job, lane, out),
            13 if S::BLOCK >= 13 => block::<S, C, 13>(simd, job, lane, out),
            14 if S::BLOCK >= 14 => block::<S, C, 14>(simd, job, lane, out),
            _ => unreachable!("a block of at most {} cells, got {n}", S::BLOCK),
        }
    }
}

#[inline(always)]
fn block<S: Simd, C: Borrow<[f32; N_CHANNELS]>, const N: usize>(
    simd: S,
    job: &Sums<'_, C>,
    lane: usize,
    out: &mut [Row],
) {
    let mut sums = [[simd.splat(0.0); 2]; N];
    let rows = job.weights.chunks_exact(job.filter_cols * N_CHANNELS);
    for (r, weights) in rows.enumerate() {
        let (weights, _) = weights.as_chunks::<N_CHANNELS>();
        let cells = &job.cells[r * job.stride..];
        for (weights, cells) in weights.iter().zip(cells.windows(N)) {
            for (k, weight) in weights.iter().enumerate() {
                let low = simd.load(&weight.0[lane..]);
                let high = simd.load(&weight.0[lane + S::LANES..]);
                for (sum, cell) in sums.iter_mut().zip(cells) {
                    let cell = simd.splat(cell.borrow()[k]);
                    sum[0] = simd.mul_add(cell, low, sum[0]);
                    sum[1] = simd.mul_add(cell, high, sum[1]);
                }
            }
        }
    }
    for (sum, out) in sums.iter().zip(&mut out[..N]) {
        simd.store(sum[0], &mut out.0[lane..]);
        simd.store(sum[1], &mut out.0[lane + S::LANES..]);
    }
}

/// A stretch of a row in the maps of consecutive filters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch {
    /// First index in the map of the first filter.
    pub(super) at: usize,
    /// Number of values from the map of one filter to that of the next.
    pub(super) plane: usize,
    /// Number of filters, at most [`N_LANES`].
    pub(super) n_filters: usize,
}

/// Transposes the values of a stretch: from the order cell, filter to the order filter, cell.
///
/// * `cells`: cells of the stretch, followed by up to `S::LANES - 1` unused ones.
#[inline(always)]
pub(super) fn put<S: Simd>(simd: S, cells: &[Row], n: usize, to: Stretch, out: &mut [f32]) {
    for x in (0..n).step_by(S::LANES) {
        let width = S::LANES.min(n - x);
        for lane in (0..to.n_filters).step_by(S::LANES) {
            let columns = simd.transposed(&cells[x..], lane);
            for (it, column) in columns.as_ref().iter().enumerate() {
                if lane + it < to.n_filters {
                    let at = to.at + (lane + it) * to.plane + x;
                    simd.store_partial(*column, &mut out[at..at + width]);
                }
            }
        }
    }
}
