//! Convolutions of a few neighbouring pixels and two registers of outputs at a time.
#![expect(
    clippy::needless_range_loop,
    reason = "only loops over ranges are always unrolled, which keeps sums in registers"
)]

use super::blocked::BLOCK;
use super::{Blocked, BlockedShape, Conv, Outputs};
use crate::isa::Isa;
use crate::simd::{Kernel, Simd};

/// Maximum number of pixels whose sums are computed at once.
const MOST_PIXELS: usize = 8;
/// Number of weights of a block of outputs that stay in the first-level cache while the pixels are processed, in floats.
const CHUNK: usize = 4608;

/// Convolves stacks whose shapes the caller has checked.
pub(super) fn run(
    isa: Isa,
    conv: &Conv,
    (input, residual): (&Blocked, Option<&Blocked>),
    outputs: Outputs<'_>,
) {
    let Some(shape) = outputs.shape() else {
        return;
    };
    let Outputs { raw, relu } = outputs;
    isa.run(Layer {
        conv,
        from: input.shape(),
        input: input.values(),
        residual: residual.map(Blocked::values),
        shape,
        raw: raw.map(Blocked::values_mut),
        relu: relu.map(Blocked::values_mut),
    });
}

pub(super) struct Layer<'a> {
    pub(super) conv: &'a Conv,
    pub(super) from: BlockedShape,
    pub(super) input: &'a [f32],
    pub(super) residual: Option<&'a [f32]>,
    /// The shape of the outputs and the residual.
    pub(super) shape: BlockedShape,
    pub(super) raw: Option<&'a mut [f32]>,
    pub(super) relu: Option<&'a mut [f32]>,
}

/// Consecutive pixels, row by row, with the residual that is added to their sums.
struct Tile<const N: usize> {
    /// The first output in the registers.
    lane: usize,
    /// Indices of the pixels in the first block of the outputs.
    pixels: [usize; N],
    is_first: bool,
    is_last: bool,
}

/// The position of a tile.
#[derive(Clone, Copy)]
struct Place {
    lane: usize,
    row: usize,
    col: usize,
    /// The first block of the input, and the number of blocks.
    block: usize,
    n_blocks: usize,
}

impl Kernel for Layer<'_> {
    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let n_blocks = self.from.n_blocks();
        let at_once = (CHUNK / self.per_block()).max(1);
        let most = MOST_PIXELS.min(S::BLOCK);
        for lane in (0..self.shape.n_blocks() * BLOCK).step_by(2 * S::LANES) {
            for block in (0..n_blocks).step_by(at_once) {
                let mut left = self.shape.rows * self.shape.cols;
                let mut place = Place {
                    lane,
                    row: 0,
                    col: 0,
                    block,
                    n_blocks: at_once.min(n_blocks - block),
                };
                while left > 0 {
                    let n = left.div_ceil(left.div_ceil(most));
                    self.pixels(simd, n, &mut place);
                    left -= n;
                }
            }
        }
    }
}

impl<'a> Layer<'a> {
    /// The weights of a block of outputs for a block of the input.
    #[inline(always)]
    fn per_block(&self) -> usize {
        let [rows, cols] = self.conv.size.kernel;
        rows * cols * self.from.width * BLOCK
    }

    #[inline(always)]
    fn pixels<S: Simd>(&mut self, simd: S, n: usize, place: &mut Place) {
        match n {
            1 => self.tile::<S, 1>(simd, place),
            2 => self.tile::<S, 2>(simd, place),
            3 => self.tile::<S, 3>(simd, place),
            4 => self.tile::<S, 4>(simd, place),
            5 => self.tile::<S, 5>(simd, place),
            6 => self.tile::<S, 6>(simd, place),
            7 if S::BLOCK >= 7 => self.tile::<S, 7>(simd, place),
            8 if S::BLOCK >= 8 => self.tile::<S, 8>(simd, place),
            _ => unreachable!("at most {MOST_PIXELS} pixels, got {n}"),
        }
    }

    /// Computes the sums at `N` pixels, and moves the position to the next pixel after them.
    #[inline(always)]
    fn tile<S: Simd, const N: usize>(&mut self, simd: S, place: &mut Place) {
        let (size, from) = (&self.conv.size, self.from);
        let corner = (from.border - size.pad[0]) * from.row()
            + (from.border - size.pad[1]) * from.width
            + place.block * from.plane();
        let down = size.stride[0] * from.row();
        let across = size.stride[1] * from.width;
        let mut inputs = [self.input; N];
        let mut pixels = [0; N];
        let (block, lane, n_blocks) = (place.block, place.lane, place.n_blocks);
        for at in 0..N {
            inputs[at] = &self.input[corner + place.row * down + place.col * across..];
            pixels[at] = self.shape.at(0, place.row, place.col);
            place.col += 1;
            if place.col == self.shape.cols {
                (place.row, place.col) = (place.row + 1, 0);
            }
        }
        let tile = Tile {
            lane,
            pixels,
            is_first: block == 0,
            is_last: block + n_blocks == from.n_blocks(),
        };
        let rows = [size.kernel[0], size.kernel[1] * from.width];
        // The two registers belong to the same block of outputs or to two different blocks.
        let weights = [
            self.weights(lane, block, n_blocks),
            self.weights(lane + S::LANES, block, n_blocks),
        ];
        let ends = Ends {
            bias: self.conv.packed_bias(),
            residual: self.residual,
            shape: self.shape,
            raw: self.raw.as_deref_mut(),
            relu: self.relu.as_deref_mut(),
        };
        simd.apart(Products {
            inputs,
            weights,
            n_blocks,
            plane: from.plane(),
            n_rows: rows[0],
            row: from.row(),
            run: rows[1],
            tile,
            ends,
        });
    }

    /// The weights of the outputs in a register for blocks of the input.
    #[inline(always)]
    fn weights(&self, lane: usize, block: usize, n: usize) -> &'a [f32] {
        let begin = lane / BLOCK * self.from.n_blocks() + block;
        let per_block = self.per_block();
        let conv: &'a Conv = self.conv;
        let weights = &conv.packed_weights()[begin * per_block..];
        &weights[..n * per_block][lane % BLOCK..]
    }
}

/// Initial values and destinations of sums.
struct Ends<'a> {
    bias: &'a [f32],
    residual: Option<&'a [f32]>,
    shape: BlockedShape,
    raw: Option<&'a mut [f32]>,
    relu: Option<&'a mut [f32]>,
}

impl Ends<'_> {
    /// Loads the biases, or the sums of earlier blocks of the input.
    ///
    /// * `half`: the first or the second register of sums.
    #[inline(always)]
    fn begin<S: Simd, const N: usize>(
        &self,
        simd: S,
        tile: &Tile<N>,
        half: usize,
        sums: &mut [[S::V; 2]; N],
    ) {
        let lane = tile.lane + half * S::LANES;
        let part = self.raw.as_deref().or(self.relu.as_deref());
        if let (false, Some(values)) = (tile.is_first, part)
            && lane / BLOCK < self.shape.n_blocks()
        {
            let part = &values[lane / BLOCK * self.shape.plane() + lane % BLOCK..];
            for at in 0..N {
                sums[at][half] = simd.load(&part[tile.pixels[at]..]);
            }
        } else {
            let bias = simd.load(&self.bias[lane..]);
            for at in 0..N {
                sums[at][half] = bias;
            }
        }
    }

    /// Writes sums, which may still be partial.
    ///
    /// * `half`: the first or the second register of sums.
    #[inline(always)]
    fn end<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        tile: &Tile<N>,
        half: usize,
        sums: &mut [[S::V; 2]; N],
    ) {
        let lane = tile.lane + half * S::LANES;
        let (block, lane) = (lane / BLOCK, lane % BLOCK);
        if block >= self.shape.n_blocks() {
            return;
        }
        let begin = block * self.shape.plane() + lane;
        if let (true, Some(residual)) = (tile.is_last, self.residual) {
            let residual = &residual[begin..];
            for at in 0..N {
                sums[at][half] = simd.add(sums[at][half], simd.load(&residual[tile.pixels[at]..]));
            }
        }
        let is_part = !tile.is_last && self.raw.is_none();
        if let Some(raw) = &mut self.raw {
            for at in 0..N {
                simd.store(sums[at][half], &mut raw[begin + tile.pixels[at]..]);
            }
        }
        if let Some(relu) = self.relu.as_mut().filter(|_| is_part || tile.is_last) {
            let least = simd.splat(if is_part { f32::NEG_INFINITY } else { 0.0 });
            for at in 0..N {
                let sum = simd.max(least, sums[at][half]);
                simd.store(sum, &mut relu[begin + tile.pixels[at]..]);
            }
        }
    }
}

/// Products that are added to the sums at a few pixels, with two registers of outputs each.
struct Products<'a, const N: usize> {
    /// For each pixel, the values from the first one under the kernel.
    inputs: [&'a [f32]; N],
    /// Weights of the outputs in each register, [`BLOCK`] floats for each value under the kernel.
    weights: [&'a [f32]; 2],
    n_blocks: usize,
    plane: usize,
    n_rows: usize,
    row: usize,
    /// Number of neighbouring values in a row of the kernel and a block of channels.
    run: usize,
    tile: Tile<N>,
    ends: Ends<'a>,
}

impl<const N: usize> Kernel for Products<'_, N> {
    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let mut sums = [[simd.splat(0.0); 2]; N];
        self.ends.begin(simd, &self.tile, 0, &mut sums);
        self.ends.begin(simd, &self.tile, 1, &mut sums);
        let mut at = 0_usize;
        for block in 0..self.n_blocks {
            for row in 0..self.n_rows {
                let begin = block * self.plane + row * self.row;
                for tap in begin..begin + self.run {
                    // SAFETY: there are as many weights as iterations of the loops, each in a block that contains a register.
                    let low = unsafe { simd.load_at(self.weights[0], at) };
                    // SAFETY: as above.
                    let high = unsafe { simd.load_at(self.weights[1], at) };
                    at = at.wrapping_add(BLOCK);
                    for pixel in 0..N {
                        // SAFETY: `Conv::check` has made sure that the input and its border contain everything that the kernel
                        // reaches.
                        let value = unsafe { self.inputs[pixel].get_unchecked(tap) };
                        let value = simd.splat(*value);
                        sums[pixel][0] = simd.mul_add(value, low, sums[pixel][0]);
                        sums[pixel][1] = simd.mul_add(value, high, sums[pixel][1]);
                    }
                }
            }
        }
        self.ends.end(simd, &self.tile, 0, &mut sums);
        self.ends.end(simd, &self.tile, 1, &mut sums);
    }
}
