//! The mean of bilinear samples, for maps that rotate or enlarge.
//!
//! All samples of an output pixel are one weighted sum of the source pixels around its centre. The weights depend only on the position of
//! the centre between source pixels. They are therefore tabulated for each *phase* (that position, rounded), and each pixel takes one short
//! integer correlation, regardless of the number of samples.

use super::{Affine, Fill};
use crate::Size;

/// Number of source pixels in a block of a kernel row. Three channels of them fill whole vector registers.
const BLOCK_PIXELS: usize = 8;
const BLOCK: usize = 3 * BLOCK_PIXELS;

/// Number of fractional bits of source positions.
pub(super) const POSITION_BITS: u32 = 32;

/// Number of fractional bits of weights. The weights of a kernel add up to exactly `1 << WEIGHT_BITS`, so that a constant image is
/// unchanged.
const WEIGHT_BITS: u32 = 14;

/// Weights per byte of a stretch of a source row: the weight of every pixel appears three times.
type Block = [i16; BLOCK];

/// Weighted values, added up per byte of a block.
type Sums = [i32; BLOCK];

#[derive(Debug, Clone)]
pub(super) struct Sampled {
    source: Size,
    output: Size,
    fill: Fill,
    /// `source_from_output` in fixed point.
    map: [[i64; 3]; 2],
    footprint: Footprint,
    /// Positions are rounded to `2^-phase_bits` source pixels.
    phase_bits: u32,
    /// Kernels, indexed by `[phase y][phase x][row][block]`.
    kernels: Vec<Block>,
    /// Sums of one output row.
    sums: Vec<Sums>,
}

/// Position of the centre of an output pixel in the source.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Phase of the centre within a source pixel, along rows and columns.
    phase: [usize; 2],
    /// First column and row of the footprint.
    left: i64,
    top: i64,
}

/// Position of a row of the output in the source.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    /// Column and row of the first pixel, in fixed point, with an offset for rounding.
    pub(super) at: [i64; 2],
    /// Step from one pixel of the row to the next.
    pub(super) step: [i64; 2],
    /// Number of bytes of a row of the source.
    pub(super) stride: usize,
}

/// The source pixels that a kernel covers, relative to the pixel that contains its centre.
#[derive(Debug, Clone, Copy)]
struct Footprint {
    left: i64,
    top: i64,
    n_columns: usize,
    n_rows: usize,
    n_blocks: usize,
}

impl Sampled {
    /// Prepares the samples.
    ///
    /// * `n_samples`: number of samples per output pixel along its rows and columns.
    pub(super) fn new(
        sizes: [Size; 2],
        source_from_output: &Affine,
        n_samples: [usize; 2],
        fill: Fill,
    ) -> Self {
        let one = (1_i64 << POSITION_BITS) as f64;
        let phase_bits = phase_bits(n_samples);
        let offsets = sample_offsets(source_from_output, n_samples);
        let n_phases = 1 << phase_bits;
        let last_fraction = 1.0 - 1.0 / f64::from(n_phases);
        let footprint = Footprint::new(&offsets, last_fraction);
        let phases = (0..n_phases).flat_map(|y| (0..n_phases).map(move |x| [x, y]));
        let kernels = phases
            .flat_map(|phase| {
                let fraction = phase.map(|phase: i32| f64::from(phase) / f64::from(n_phases));
                footprint.kernel(&offsets, fraction)
            })
            .collect();
        Self {
            source: sizes[0],
            output: sizes[1],
            fill,
            map: source_from_output.map(|row| row.map(|row| (row * one).round() as i64)),
            footprint,
            phase_bits,
            kernels,
            sums: vec![[0; BLOCK]; sizes[1].width],
        }
    }

    /// Returns the number of output pixels of a row.
    pub(super) fn width(&self) -> usize {
        self.output.width
    }

    /// Returns the position of a row in the source, starting from one of its pixels.
    #[inline(always)]
    pub(super) fn start(&self, [x, y]: [usize; 2]) -> Start {
        let half = 1 << (POSITION_BITS - self.phase_bits - 1);
        Start {
            at: self.map.map(|[a, b, t]| a * x as i64 + b * y as i64 + t + half),
            step: self.map.map(|[a, ..]| a),
            stride: 3 * self.source.width,
        }
    }

    /// Returns true if the source has all pixels of an output pixel's footprint, and one more column.
    #[inline(always)]
    pub(super) fn has_all(&self, at: [i64; 2]) -> bool {
        let Footprint {
            n_columns, n_rows, ..
        } = self.footprint;
        let place = self.place(at);
        let fits = |first: i64, n: usize, all: usize| first >= 0 && first + n as i64 <= all as i64;
        fits(place.left, n_columns + 1, self.source.width)
            && fits(place.top, n_rows, self.source.height)
    }

    /// Returns true if every output pixel is one bilinear sample, and positions have this number of fractional bits.
    pub(super) fn is_bilinear(&self, part_bits: u32) -> bool {
        let Footprint {
            n_columns, n_rows, ..
        } = self.footprint;
        [n_columns, n_rows] == [2, 2] && self.phase_bits == part_bits
    }

    /// Computes one output pixel at the border of the source, or outside.
    pub(super) fn pixel_across(&self, source: &[u8], at: [i64; 2]) -> [u8; 3] {
        rounded(by_channel(&self.add_across(source, &self.place(at))))
    }

    /// There are two passes over every row, because compilers vectorise them only separately: sums per byte of a
    /// block, then sums per channel.
    #[inline(always)]
    pub(super) fn apply(&mut self, source: &[u8], out: &mut [u8]) {
        let mut sums = std::mem::take(&mut self.sums);
        let pixels = out.as_chunks_mut::<3>().0;
        for (y, row) in pixels.chunks_exact_mut(self.output.width).enumerate() {
            for (x, sums) in sums.iter_mut().enumerate() {
                self.add_up(source, [x as i64, y as i64], sums);
            }
            for (sums, pixel) in sums.iter().zip(row) {
                *pixel = rounded(by_channel(sums));
            }
        }
        self.sums = sums;
    }

    /// Returns the products of one output pixel, added up per byte of a block.
    #[inline(always)]
    fn add_up(&self, source: &[u8], at: [i64; 2], sums: &mut Sums) {
        let place = self.place(at);
        match self.inside(&place) {
            Some(at) => self.add_inside(&source[at..], self.kernel(&place), sums),
            None => *sums = self.add_across(source, &place),
        }
    }

    /// Returns the position of the centre of an output pixel in the source.
    #[inline(always)]
    pub(super) fn place(&self, [x, y]: [i64; 2]) -> Place {
        let half = 1 << (POSITION_BITS - self.phase_bits - 1);
        let [u, v] = self
            .map
            .map(|[a, b, t]| (a * x + b * y + t + half) >> (POSITION_BITS - self.phase_bits));
        let mask = (1 << self.phase_bits) - 1;
        Place {
            phase: [u & mask, v & mask].map(|phase| phase as usize),
            left: (u >> self.phase_bits) + self.footprint.left,
            top: (v >> self.phase_bits) + self.footprint.top,
        }
    }

    #[inline(always)]
    fn kernel(&self, place: &Place) -> &[Block] {
        let phase = (place.phase[1] << self.phase_bits) | place.phase[0];
        let n_kernel = self.footprint.n_rows * self.footprint.n_blocks;
        &self.kernels[phase * n_kernel..][..n_kernel]
    }

    /// Returns the index of the first byte of the footprint, if all its blocks are inside the source.
    #[inline(always)]
    fn inside(&self, place: &Place) -> Option<usize> {
        let (left, top) = (
            usize::try_from(place.left).ok()?,
            usize::try_from(place.top).ok()?,
        );
        let Footprint {
            n_columns,
            n_rows,
            n_blocks,
            ..
        } = self.footprint;
        let width = self.source.width;
        // A block may extend into the next row, with weights of 0, but not beyond the last row.
        let end = ((top + n_rows - 1) * width + left) * 3 + n_blocks * BLOCK;
        let is_inside = left + n_columns <= width && end <= self.source.rgb_bytes();
        is_inside.then_some((top * width + left) * 3)
    }

    #[inline(always)]
    fn add_inside(&self, source: &[u8], kernel: &[Block], sums: &mut Sums) {
        let mut added = [0; BLOCK];
        for (row, blocks) in kernel.chunks_exact(self.footprint.n_blocks).enumerate() {
            let values = &source[row * self.source.width * 3..];
            for (weights, values) in blocks.iter().zip(values.as_chunks::<BLOCK>().0) {
                for ((sum, &weight), &value) in added.iter_mut().zip(weights).zip(values) {
                    *sum += i32::from(weight) * i32::from(value);
                }
            }
        }
        *sums = added;
    }

    /// Returns the same sums, already per channel, if some pixels are outside the source.
    #[cold]
    fn add_across(&self, source: &[u8], place: &Place) -> Sums {
        let kernel = self.kernel(place);
        let footprint = self.footprint;
        let columns = Axis::new(
            place.left,
            footprint.n_columns,
            self.source.width,
            self.fill,
        );
        let rows = Axis::new(place.top, footprint.n_rows, self.source.height, self.fill);
        let mut sums = [0; BLOCK];
        for (row, y) in rows.positions() {
            for (column, x) in columns.positions() {
                let block = &kernel[row * footprint.n_blocks + column / BLOCK_PIXELS];
                let weight = i32::from(block[column % BLOCK_PIXELS * 3]);
                let at = (y * self.source.width + x) * 3;
                for (total, &value) in sums.iter_mut().zip(&source[at..at + 3]) {
                    *total += weight * i32::from(value);
                }
            }
        }
        sums
    }
}

/// Position of a stretch of kernel taps on an axis of the source.
#[derive(Clone, Copy)]
struct Axis {
    first: i64,
    n_taps: usize,
    last: i64,
    fill: Fill,
}

impl Axis {
    fn new(first: i64, n_taps: usize, n_source: usize, fill: Fill) -> Self {
        Self {
            first,
            n_taps,
            last: n_source as i64 - 1,
            fill,
        }
    }

    /// Iterates over the taps that are on a pixel, with the index of that pixel.
    fn positions(self) -> impl Iterator<Item = (usize, usize)> {
        let taps = match self.fill {
            Fill::Replicate => 0..self.n_taps as i64,
            Fill::Black => {
                let end = (self.last - self.first + 1).min(self.n_taps as i64);
                (-self.first).max(0)..end
            }
        };
        taps.map(move |tap| {
            let position = (self.first + tap).clamp(0, self.last);
            (tap as usize, position as usize)
        })
    }
}

/// Adds up the pixels of a block, halving it as long as whole pixels stay together.
#[inline(always)]
fn by_channel(sums: &Sums) -> [i32; 3] {
    let halves: [i32; BLOCK / 2] = std::array::from_fn(|i| sums[i] + sums[i + BLOCK / 2]);
    let quarters: [i32; BLOCK / 4] = std::array::from_fn(|i| halves[i] + halves[i + BLOCK / 4]);
    std::array::from_fn(|i| quarters[i] + quarters[i + 3])
}

#[inline(always)]
fn rounded(total: [i32; 3]) -> [u8; 3] {
    total.map(|total| ((total + (1 << (WEIGHT_BITS - 1))) >> WEIGHT_BITS) as u8)
}

/// Returns the number of fractional bits of a phase: 1/32 source pixel, but not finer than 1/128 output pixel. Large kernels need fewer
/// phases.
fn phase_bits(n_samples: [usize; 2]) -> u32 {
    match n_samples[0].max(n_samples[1]) {
        0..=4 => 5,
        5..=8 => 4,
        9..=16 => 3,
        _ => 2,
    }
}

/// Returns the positions of the samples relative to the centre of an output pixel, in source pixels.
fn sample_offsets(map: &Affine, n_samples: [usize; 2]) -> Vec<[f64; 2]> {
    let centred = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 - 0.5;
    let mut offsets = Vec::with_capacity(n_samples[0] * n_samples[1]);
    for j in 0..n_samples[1] {
        for i in 0..n_samples[0] {
            let (x, y) = (centred(i, n_samples[0]), centred(j, n_samples[1]));
            offsets.push(map.map(|[a, b, _]| a * x + b * y));
        }
    }
    offsets
}

impl Footprint {
    /// Returns all pixels that samples at `offsets` touch, for phases up to `last_fraction` of a pixel.
    fn new(offsets: &[[f64; 2]], last_fraction: f64) -> Self {
        let range = |axis: usize| {
            let values = || offsets.iter().map(move |offset| offset[axis]);
            let first = values().map(|value| value.floor() as i64).min().unwrap_or(0);
            let last = values().map(|value| (last_fraction + value).floor() as i64 + 1);
            (first, (last.max().unwrap_or(1) - first + 1) as usize)
        };
        let ((left, n_columns), (top, n_rows)) = (range(0), range(1));
        Self {
            left,
            top,
            n_columns,
            n_rows,
            n_blocks: n_columns.div_ceil(BLOCK_PIXELS),
        }
    }

    /// Returns the weights of all samples together, with the centre at `fraction` of a source pixel.
    fn kernel(&self, offsets: &[[f64; 2]], fraction: [f64; 2]) -> Vec<Block> {
        let mut weights = vec![0.0; self.n_columns * self.n_rows];
        let share = f64::from(1 << WEIGHT_BITS) / offsets.len() as f64;
        for offset in offsets {
            let (x, y) = (fraction[0] + offset[0], fraction[1] + offset[1]);
            let (fx, fy) = (x - x.floor(), y - y.floor());
            let column = (x.floor() as i64 - self.left) as usize;
            let row = (y.floor() as i64 - self.top) as usize;
            let at = row * self.n_columns + column;
            weights[at] += share * (1.0 - fx) * (1.0 - fy);
            weights[at + 1] += share * fx * (1.0 - fy);
            weights[at + self.n_columns] += share * (1.0 - fx) * fy;
            weights[at + self.n_columns + 1] += share * fx * fy;
        }
        let weights = integers(&weights);
        let mut blocks = vec![[0; BLOCK]; self.n_rows * self.n_blocks];
        for (at, &weight) in weights.iter().enumerate() {
            let (row, column) = (at / self.n_columns, at % self.n_columns);
            let block = &mut blocks[row * self.n_blocks + column / BLOCK_PIXELS];
            block[column % BLOCK_PIXELS * 3..][..3].fill(weight);
        }
        blocks
    }
}

/// Rounds weights so that their sum stays `1 << WEIGHT_BITS`. The largest weight absorbs the rounding error.
fn integers(weights: &[f64]) -> Vec<i16> {
    let mut rounded: Vec<i16> = weights.iter().map(|weight| weight.round() as i16).collect();
    let sum: i32 = rounded.iter().copied().map(i32::from).sum();
    if let Some(largest) = rounded.iter_mut().max() {
        *largest += ((1 << WEIGHT_BITS) - sum) as i16;
    }
    rounded
}
