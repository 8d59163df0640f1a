//! Computes bilinear samples in few steps.
//!
//! [`Bilinear`] is the readable reference, which gives bit-identical results. It also computes the pixels at the border.

use std::ops::Range;

use super::bilinear::{Bilinear, PART_BITS, PARTS, POSITION_BITS, SUM_BITS, Start};

/// Number of bytes that are copied for a pixel: its three channels, and one of the next pixel.
const LANES: usize = 4;
/// Number of positions that are processed together.
const TILE: usize = 64;

/// A lane for each channel of every position of a tile.
type Lanes = [[u8; LANES]; TILE];

/// Computes the mean of the four source pixels around every position, weighted by their nearness.
#[derive(Debug, Clone)]
pub(super) struct Near(pub(super) Bilinear);

/// Data of several positions of a row.
struct Tile {
    /// Source pixels above left, above right, below left and below right of the position.
    around: [Lanes; 4],
    /// Distance of the position from the left pixels, and from the upper pixels, in 1/32 pixel.
    parts: [Lanes; 2],
    mean: Lanes,
}

impl Near {
    #[inline(always)]
    pub(super) fn apply(&self, source: &[u8], out: &mut [u8]) {
        let mut tile = Tile {
            around: [[[0; LANES]; TILE]; 4],
            parts: [[[0; LANES]; TILE]; 2],
            mean: [[0; LANES]; TILE],
        };
        let width = self.0.width();
        let pixels = out.as_chunks_mut::<3>().0;
        for (y, row) in pixels.chunks_exact_mut(width).enumerate() {
            let within = self.within(y);
            for x in (0..within.start).chain(within.end..width) {
                row[x] = self.0.pixel(source, [x, y]);
            }
            let start = within.start;
            for (nth, pixels) in row[within].chunks_mut(TILE).enumerate() {
                let start = self.0.start([start + nth * TILE, y]);
                tile.copy(source, start, pixels.len());
                tile.add_up();
                for (pixel, mean) in pixels.iter_mut().zip(&tile.mean) {
                    *pixel = [mean[0], mean[1], mean[2]];
                }
            }
        }
    }

    /// Returns the part of an output row whose positions have all four pixels. It is one range, because a row is straight in the source.
    #[inline(always)]
    fn within(&self, y: usize) -> Range<usize> {
        let width = self.0.width();
        let has_all = |x: &usize| self.0.has_all([*x, y]);
        let first = (0..width).find(has_all).unwrap_or(width);
        let end = (first..width).rfind(has_all).map_or(first, |last| last + 1);
        first..end
    }
}

impl Tile {
    /// Copies the pixels around `n` positions of a row.
    #[inline(always)]
    fn copy(&mut self, source: &[u8], start: Start, n: usize) {
        let Start {
            at: [mut u, mut v],
            step,
            stride,
        } = start;
        let [a, b, c, d] = &mut self.around;
        let [right, below] = &mut self.parts;
        for x in 0..n.min(TILE) {
            let [column, row] = [u, v].map(|at| (at >> POSITION_BITS) as usize);
            let first = row * stride + 3 * column;
            // `has_all` has checked that the source contains one pixel more than a position uses.
            let eight = |at: usize| {
                let bytes = &source[at..at + 8];
                u64::from_le_bytes(std::array::from_fn(|nth| bytes[nth]))
            };
            let [upper, lower] = [first, first + stride].map(eight);
            a[x] = (upper as u32).to_le_bytes();
            b[x] = ((upper >> 24) as u32).to_le_bytes();
            c[x] = (lower as u32).to_le_bytes();
            d[x] = ((lower >> 24) as u32).to_le_bytes();
            let [part_u, part_v] =
                [u, v].map(|at| (at >> (POSITION_BITS - PART_BITS)) as u8 % PARTS as u8);
            right[x] = [part_u; LANES];
            below[x] = [part_v; LANES];
            u += step[0];
            v += step[1];
        }
    }

    /// Adds up the products, in a separate pass, because compilers vectorise only this pass.
    #[inline(always)]
    fn add_up(&mut self) {
        let [a, b, c, d] = self.around.each_ref().map(|lanes| lanes.as_flattened());
        let [right, below] = self.parts.each_ref().map(|lanes| lanes.as_flattened());
        let mean = self.mean.as_flattened_mut();
        for i in 0..LANES * TILE {
            let [right, below] = [right[i], below[i]].map(u16::from);
            let [a, b, c, d] = [a[i], b[i], c[i], d[i]].map(u16::from);
            let upper = a * (PARTS - right) + b * right;
            let lower = c * (PARTS - right) + d * right;
            let sum =
                u32::from(upper) * u32::from(PARTS - below) + u32::from(lower) * u32::from(below);
            mean[i] = ((sum + (1 << (SUM_BITS - 1))) >> SUM_BITS) as u8;
        }
    }
}
