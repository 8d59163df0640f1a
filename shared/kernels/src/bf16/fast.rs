//! The same on the matrix unit.
//!
//! Placements are numbered along the rows of the padded map, those that hang over its right border
//! included: so a tile of cells is any sixteen in a row, at the beginning of a cache line each. What
//! hangs over is left out where the sums are put into their planes.

use std::ops::Range;

use super::{Bf16Level, Bf16Map, Panel};
use crate::amx::{Amx, Tiles};
use crate::isa::Isa;
use crate::simd::{Kernel, Row, Simd};
use crate::tiles::{BLOCK, Block, Sums};

/// Placements that all panels answer before the next ones: their cells stay in the cache.
const STRIP: usize = 16 * BLOCK;

/// All responses; see [`super::Bf16Bank::correlate`].
#[expect(
    single_use_lifetimes,
    reason = "an argument of type `impl Trait` cannot do without a name"
)]
pub(super) fn correlate<'a>(
    (amx, isa): (Amx, Isa),
    panels: &[Panel],
    levels: impl Iterator<Item = Bf16Level<'a>>,
    mut out: &mut [f32],
) {
    let n_filters: usize = panels.iter().map(|it| it.filters.len()).sum();
    let tiles = Tiles::new(amx);
    for Bf16Level { map, size } in levels {
        let n = n_filters * size[0] * size[1];
        let Some(out) = out.split_off_mut(..n).filter(|it| !it.is_empty()) else {
            continue;
        };
        isa.run(Answer {
            tiles: &tiles,
            panels,
            map,
            size,
            out,
        });
    }
}

/// All responses of a level.
struct Answer<'a> {
    tiles: &'a Tiles,
    panels: &'a [Panel],
    map: &'a Bf16Map,
    size: [usize; 2],
    out: &'a mut [f32],
}

impl Kernel for Answer<'_> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let [rows, cols] = self.size;
        let end = (rows - 1) * self.map.cols + cols;
        let mut sums = [Row::ZERO; BLOCK];
        for strip in (0..end).step_by(STRIP) {
            let mut maps = 0;
            for panel in self.panels {
                for first in (strip..end.min(strip + STRIP)).step_by(BLOCK) {
                    let job = Sums {
                        cells: &self.map.cells[first..],
                        stride: self.map.cols,
                        filter: panel.filter,
                        weights: &panel.weights,
                    };
                    let there = Placements::of(first..end.min(first + BLOCK), self.map.cols, cols);
                    let to = (maps + there.at, rows * cols, panel.filters.len());
                    prefetch(simd, there.inside, to, self.out);
                    self.tiles.sums(&job, &mut sums);
                    put(simd, &sums, there.inside, to, self.out);
                }
                maps += panel.filters.len() * rows * cols;
            }
        }
    }
}

/// Placements of a block.
struct Placements {
    /// A bit for each that does not hang over.
    inside: u32,
    /// The number of those before it.
    at: usize,
}

impl Placements {
    /// * `block`: [`BLOCK`] at most, numbered along the rows of a map of `stride` columns.
    #[inline(always)]
    fn of(block: Range<usize>, stride: usize, cols: usize) -> Self {
        let [y, x] = [block.start / stride, block.start % stride];
        let mut inside = 0;
        // Where the row begins that the next ones are on.
        let mut row = block.start - x;
        while row < block.end {
            let begin = row.max(block.start) - block.start;
            let end = (row + cols).clamp(block.start, block.end) - block.start;
            if begin < end {
                inside |= (u32::MAX >> (32 - (end - begin))) << begin;
            }
            row += stride;
        }
        Self {
            inside,
            at: y * cols + x.min(cols),
        }
    }
}

/// Has the lines of the cache brought that the sums of a block will be written to, while these are computed.
#[inline(always)]
fn prefetch<S: Simd>(
    simd: S,
    inside: u32,
    (at, plane, n_filters): (usize, usize, usize),
    out: &[f32],
) {
    let n = inside.count_ones() as usize;
    if n == 0 {
        return;
    }
    for map in 0..n_filters {
        let there = &out[at + map * plane..][..n];
        // Two lines or three: 32 values at most.
        for it in [0, n / 2, n - 1] {
            simd.prefetch(&there[it..]);
        }
    }
}

/// Writes the sums that are inside, which lie filter by filter, cell by cell.
///
/// * `to`: where the first map begins, values from map to map, and how many maps there are.
#[inline(always)]
fn put<S: Simd>(
    simd: S,
    sums: &Block,
    inside: u32,
    (mut at, plane, n_filters): (usize, usize, usize),
    out: &mut [f32],
) {
    for x in (0..BLOCK).step_by(S::LANES) {
        let inside = inside >> x & (u32::MAX >> (32 - S::LANES));
        let n = inside.count_ones() as usize;
        if n == 0 {
            continue;
        }
        for lane in (0..n_filters).step_by(S::LANES) {
            let columns = simd.transposed(&sums[x..], lane);
            for (it, column) in columns.as_ref().iter().enumerate() {
                if lane + it < n_filters {
                    let to = &mut out[at + (lane + it) * plane..][..n];
                    simd.store_lanes(*column, inside, to);
                }
            }
        }
        at += n;
    }
}
