//! AVX-512: lanes are filters, so every lane adds in the reference's order.

use std::arch::x86_64::{
    __m512, _mm512_fmadd_ps, _mm512_loadu_ps, _mm512_set1_ps, _mm512_setzero_ps, _mm512_storeu_ps,
};

use super::{FeatureMap, PANEL, Panel, blocks};
use crate::N_CHANNELS;

const LANES: usize = 16;
/// Registers of filters in a block; with [`BLOCK`] cells its sums fill the register file.
const WIDE: usize = 2;
/// Cells of a row that are summed at once.
const BLOCK: usize = 14;

#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
pub(super) fn correlate(
    panel: &Panel,
    map: FeatureMap<'_>,
    [rows, cols]: [usize; 2],
    out: &mut [f32],
) {
    for first in (0..panel.filters.len()).step_by(LANES * WIDE) {
        let out = &mut out[first * rows * cols..];
        for y in 0..rows {
            for block in blocks(cols, BLOCK) {
                let origin = (y * map.cols + block.start) * N_CHANNELS;
                let cells = &map.cells[origin..];
                let target = Target {
                    at: y * cols + block.start,
                    map: rows * cols,
                    n_filters: (panel.filters.len() - first).min(LANES * WIDE),
                };
                dispatch(
                    block.len(),
                    (panel, first),
                    (cells, map.cols),
                    (target, out),
                );
            }
        }
    }
}

/// Where a block's sums go.
#[derive(Clone, Copy)]
struct Target {
    at: usize,
    map: usize,
    n_filters: usize,
}

#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn dispatch(n: usize, panel: (&Panel, usize), map: (&[f32], usize), out: (Target, &mut [f32])) {
    match n {
        1 => block::<1>(panel, map, out),
        2 => block::<2>(panel, map, out),
        3 => block::<3>(panel, map, out),
        4 => block::<4>(panel, map, out),
        5 => block::<5>(panel, map, out),
        6 => block::<6>(panel, map, out),
        7 => block::<7>(panel, map, out),
        8 => block::<8>(panel, map, out),
        9 => block::<9>(panel, map, out),
        10 => block::<10>(panel, map, out),
        11 => block::<11>(panel, map, out),
        12 => block::<12>(panel, map, out),
        13 => block::<13>(panel, map, out),
        _ => block::<BLOCK>(panel, map, out),
    }
}

/// Sums `N` neighbouring cells under `LANES * WIDE` filters.
#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
fn block<const N: usize>(
    (panel, first): (&Panel, usize),
    (cells, map_cols): (&[f32], usize),
    (target, out): (Target, &mut [f32]),
) {
    let run = panel.cols * N_CHANNELS;
    let mut sums = [[_mm512_setzero_ps(); WIDE]; N];
    let (weights, _) = panel.weights.as_chunks::<PANEL>();
    for (r, weights) in weights.chunks_exact(run).enumerate() {
        let cells = &cells[r * map_cols * N_CHANNELS..][..run + (N - 1) * N_CHANNELS];
        let windows = cells.windows((N - 1) * N_CHANNELS + 1);
        for (weights, cells) in weights.iter().zip(windows) {
            let weights: [__m512; WIDE] =
                std::array::from_fn(|it| load(&weights[first + it * LANES..]));
            for (n, sums) in sums.iter_mut().enumerate() {
                let cell = _mm512_set1_ps(cells[n * N_CHANNELS]);
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    *sum = _mm512_fmadd_ps(cell, weight, *sum);
                }
            }
        }
    }
    let mut transposed = [[0.0; PANEL]; N];
    for (row, sums) in transposed.iter_mut().zip(sums) {
        for (it, sum) in sums.into_iter().enumerate() {
            store(sum, &mut row[it * LANES..]);
        }
    }
    for (lane, map) in out
        .chunks_exact_mut(target.map)
        .take(target.n_filters)
        .enumerate()
    {
        for (value, row) in map[target.at..][..N].iter_mut().zip(&transposed) {
            *value = row[lane];
        }
    }
}

#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
#[inline]
fn load(from: &[f32]) -> __m512 {
    let from = &from[..LANES];
    // SAFETY: `from` has LANES floats; the load needs no alignment.
    unsafe { _mm512_loadu_ps(from.as_ptr()) }
}

#[target_feature(enable = "avx2,fma,avx512f,avx512vl")]
#[inline]
fn store(value: __m512, to: &mut [f32]) {
    let to = &mut to[..LANES];
    // SAFETY: `to` has LANES floats; the store needs no alignment.
    unsafe { _mm512_storeu_ps(to.as_mut_ptr(), value) };
}
