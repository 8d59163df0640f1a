//! One bilinear sample per output pixel: the readable reference.

use super::{Affine, Fill};
use crate::Size;

/// Number of fractional bits of source positions.
pub(super) const POSITION_BITS: u32 = 32;
/// Number of fractional bits to which a position is rounded, and number of these parts of a source pixel.
pub(super) const PART_BITS: u32 = 5;
pub(super) const PARTS: u16 = 1 << PART_BITS;
/// Number of fractional bits of the sum of all weights.
pub(super) const SUM_BITS: u32 = 2 * PART_BITS;
/// Half of a part. It is added to positions, so that they are rounded.
const HALF_PART: i64 = 1 << (POSITION_BITS - PART_BITS - 1);

/// Computes the mean of the four source pixels around the position of every output pixel, weighted by their nearness.
#[derive(Debug, Clone)]
pub(super) struct Bilinear {
    source: Size,
    output: Size,
    fill: Fill,
    /// `source_from_output` in fixed point.
    map: [[i64; 3]; 2],
}

/// Position of a row of the output in the source.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    /// Column and row of the first pixel, in fixed point, with [`HALF_PART`] for rounding.
    pub(super) at: [i64; 2],
    /// Step from one pixel of the row to the next.
    pub(super) step: [i64; 2],
    /// Number of bytes of a row of the source.
    pub(super) stride: usize,
}

impl Bilinear {
    /// Prepares the samples.
    ///
    /// * `sizes`: sizes of the source and of the output.
    pub(super) fn new(sizes: [Size; 2], source_from_output: &Affine, fill: Fill) -> Self {
        let one = (1_i64 << POSITION_BITS) as f64;
        Self {
            source: sizes[0],
            output: sizes[1],
            fill,
            map: source_from_output.map(|row| row.map(|value| (value * one).round() as i64)),
        }
    }

    /// Returns the number of output pixels of a row.
    pub(super) fn width(&self) -> usize {
        self.output.width
    }

    /// Returns the position of a row in the source, starting from one of its pixels.
    #[inline(always)]
    pub(super) fn start(&self, [x, y]: [usize; 2]) -> Start {
        Start {
            at: self.map.map(|[a, b, t]| a * x as i64 + b * y as i64 + t + HALF_PART),
            step: self.map.map(|[a, ..]| a),
            stride: 3 * self.source.width,
        }
    }

    /// Returns true if the source has the four pixels around the position of an output pixel, and one more column.
    #[inline(always)]
    pub(super) fn has_all(&self, at: [usize; 2]) -> bool {
        let [u, v] = self.start(at).at.map(|at| at >> POSITION_BITS);
        let fits = |first: i64, n: i64, all: usize| first >= 0 && first + n <= all as i64;
        fits(u, 3, self.source.width) && fits(v, 2, self.source.height)
    }

    /// Computes one output pixel, anywhere in the source or outside.
    pub(super) fn pixel(&self, source: &[u8], at: [usize; 2]) -> [u8; 3] {
        let Start { at, stride, .. } = self.start(at);
        let [u, v] = at.map(|at| at >> POSITION_BITS);
        let [right, below] =
            at.map(|at| (at >> (POSITION_BITS - PART_BITS)) as u32 % u32::from(PARTS));
        let shares = |second: u32| [u32::from(PARTS) - second, second];
        let mut sums = [0; 3];
        for (row, share) in (v..).zip(shares(below)) {
            for (column, part) in (u..).zip(shares(right)) {
                let column = self.inside(column, self.source.width);
                let row = self.inside(row, self.source.height);
                let Some((column, row)) = column.zip(row) else {
                    continue;
                };
                let pixel = &source[row * stride + 3 * column..][..3];
                for (sum, value) in sums.iter_mut().zip(pixel) {
                    *sum += share * part * u32::from(*value);
                }
            }
        }
        sums.map(|sum| ((sum + (1 << (SUM_BITS - 1))) >> SUM_BITS) as u8)
    }

    /// Returns the index of the pixel that stands for a position along an axis; `None` outside of the source if it is black there.
    fn inside(&self, at: i64, n: usize) -> Option<usize> {
        let last = n as i64 - 1;
        match self.fill {
            Fill::Black => (0..=last).contains(&at).then_some(at as usize),
            Fill::Replicate => Some(at.clamp(0, last) as usize),
        }
    }
}
