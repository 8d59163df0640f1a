//! Convolutions and sums of stacks of channels, as used by the networks that find joints.
//!
//! Weights are packed once. The sum of an output begins with its bias. The products are then added in a fixed order: one block of input
//! channels after another, within it one kernel position after another along the rows, and within that one channel after another. Each
//! product is added with a single rounding (fused multiply-add).

mod blocked;
mod fast;
mod reference;
mod sum;
mod tiles;

pub use blocked::{Blocked, BlockedShape};
pub use sum::add_repeated;
pub use tiles::Scratch;

use crate::isa::Isa;
use crate::simd::{ROW, Row, flat};
use blocked::BLOCK;

/// The sizes of a convolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConvSize {
    /// Number of input channels.
    pub inputs: usize,
    /// Number of output channels.
    pub outputs: usize,
    /// Rows and columns of the kernel.
    pub kernel: [usize; 2],
    /// Distance in rows and columns of the input between neighbouring outputs.
    pub stride: [usize; 2],
    /// Rows of zeros above the input, and columns of zeros to its left.
    pub pad: [usize; 2],
}

/// The numbers of weights and biases do not match the sizes of the convolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "a convolution from {} to {} channels with kernel {:?} has {weights} weights and {bias} biases",
    size.inputs, size.outputs, size.kernel
)]
pub struct ConvSizeError {
    /// The sizes of the convolution.
    pub size: ConvSize,
    /// Number of weights found.
    pub weights: usize,
    /// Number of biases found.
    pub bias: usize,
}

/// A convolution with its weights.
#[derive(Debug, Clone)]
pub struct Conv {
    size: ConvSize,
    /// Number of channels in a block of the input.
    width: usize,
    /// The weights, in this order: blocks of outputs, blocks of inputs, rows, columns, channels of the block, outputs of the block. Empty
    /// for a convolution in tiles.
    weights: Vec<Row>,
    /// Biases, padded with zeros to pairs of blocks like the outputs in the weights.
    bias: Vec<Row>,
    /// For a convolution in tiles: the 1 x 1 convolution of each position. Otherwise empty.
    positions: Vec<Self>,
}

/// Stacks to which a convolution or a sum writes its result: the plain values, the values with negative ones replaced by zero, or both.
#[derive(Debug)]
pub struct Outputs<'a> {
    /// The plain values.
    pub raw: Option<&'a mut Blocked>,
    /// The values with negative ones replaced by zero; NaN is kept.
    pub relu: Option<&'a mut Blocked>,
}

impl Outputs<'_> {
    fn shape(&self) -> Option<BlockedShape> {
        let any = self.raw.as_deref().or(self.relu.as_deref());
        any.map(Blocked::shape)
    }

    fn sides(&self) -> [[usize; 3]; 2] {
        let given = [&self.raw, &self.relu].map(|out| out.as_ref().map(|out| out.shape().sides()));
        let any = given[0].or(given[1]).unwrap_or_default();
        given.map(|sides| sides.unwrap_or(any))
    }

    fn set(&mut self, channel: usize, [row, col]: [usize; 2], value: f32) {
        if let Some(out) = &mut self.raw {
            out.set(channel, row, col, value);
        }
        if let Some(out) = &mut self.relu {
            out.set(channel, row, col, relu(value));
        }
    }
}

#[inline(always)]
fn relu(value: f32) -> f32 {
    if 0.0 > value { 0.0 } else { value }
}

impl Conv {
    /// Packs weights.
    ///
    /// * `weights`: `outputs x inputs x kernel rows x kernel columns`.
    /// * `packed`: true for an input in one block of all channels, as made by [`BlockedShape::packed`].
    ///
    /// # Errors
    ///
    /// Fails with [`ConvSizeError`] if the lengths do not match, or if the kernel, a stride or a number of channels is zero.
    pub fn new(
        size: ConvSize,
        weights: &[f32],
        bias: &[f32],
        packed: bool,
    ) -> Result<Self, ConvSizeError> {
        let [kernel_rows, kernel_cols] = size.kernel;
        let sides = [size.outputs, size.inputs, kernel_rows, kernel_cols];
        let n = sides.iter().try_fold(1_usize, |n, side| n.checked_mul(*side));
        let is_empty = n == Some(0) || size.stride.contains(&0);
        if n != Some(weights.len()) || bias.len() != size.outputs || is_empty {
            return Err(ConvSizeError {
                size,
                weights: weights.len(),
                bias: bias.len(),
            });
        }
        let width = if packed { size.inputs } else { BLOCK };
        let taps = kernel_rows * kernel_cols;
        let per_block = size.inputs.div_ceil(width) * taps * width * BLOCK;
        let n_outputs = size.outputs.next_multiple_of(ROW);
        let mut conv = Self {
            size,
            width,
            weights: vec![Row::ZERO; (n_outputs / BLOCK * per_block).div_ceil(ROW)],
            bias: vec![Row::ZERO; n_outputs / ROW],
            positions: Vec::new(),
        };
        let packed = crate::simd::flat_mut(&mut conv.weights);
        for (output, weights) in weights.chunks_exact(size.inputs * taps).enumerate() {
            for (input, weights) in weights.chunks_exact(taps).enumerate() {
                let row = input / width * taps * width + input % width;
                let first = output / BLOCK * per_block + row * BLOCK + output % BLOCK;
                for (tap, weight) in weights.iter().enumerate() {
                    packed[first + tap * width * BLOCK] = *weight;
                }
            }
        }
        crate::simd::flat_mut(&mut conv.bias)[..bias.len()].copy_from_slice(bias);
        Ok(conv)
    }

    /// Packs weights for a convolution in tiles of 2 x 2 outputs, which needs 16 products per tile instead of 36. Returns `None` unless the
    /// kernel is 3 x 3 and the stride 1. Outputs are rounded differently from those of [`Self::new`]. The input has blocks of 16 channels.
    ///
    /// * `weights`: `outputs x inputs x 3 x 3`.
    ///
    /// # Errors
    ///
    /// Fails like [`Self::new`].
    pub fn in_tiles(
        size: ConvSize,
        weights: &[f32],
        bias: &[f32],
    ) -> Result<Option<Self>, ConvSizeError> {
        if size.kernel != [3; 2] || size.stride != [1; 2] {
            return Ok(None);
        }
        let mut conv = Self::new(size, weights, bias, false)?;
        let at_one = ConvSize {
            kernel: [1; 2],
            pad: [0; 2],
            ..size
        };
        let no_bias = vec![0.0; size.outputs];
        let positions = tiles::positions(size, weights);
        let positions = positions.iter().map(|weights| Self::new(at_one, weights, &no_bias, false));
        conv.positions = positions.collect::<Result<_, _>>()?;
        conv.weights = Vec::new();
        Ok(Some(conv))
    }

    /// The sizes of the convolution.
    pub fn size(&self) -> ConvSize {
        self.size
    }

    /// Convolves `input`, and adds `residual`.
    ///
    /// # Panics
    ///
    /// Panics if the sizes of the stacks do not match. This includes wrong numbers of channels, a border of the input smaller than
    /// the kernel needs, and a residual whose shape or border differs from the outputs.
    pub fn run(
        &self,
        isa: Isa,
        (input, residual): (&Blocked, Option<&Blocked>),
        outputs: Outputs<'_>,
        scratch: &mut Scratch,
    ) {
        self.check(input, residual, &outputs);
        if self.positions.is_empty() {
            fast::run(isa, self, (input, residual), outputs);
        } else {
            tiles::run(isa, self, (input, residual), outputs, scratch);
        }
    }

    /// Does the same as [`Self::run`], in plain loops.
    ///
    /// # Panics
    ///
    /// Panics like [`Self::run`].
    pub fn run_plain(&self, input: &Blocked, residual: Option<&Blocked>, outputs: Outputs<'_>) {
        self.check(input, residual, &outputs);
        if self.positions.is_empty() {
            reference::run(self, input, residual, outputs);
        } else {
            tiles::run_plain(self, (input, residual), outputs);
        }
    }

    fn check(&self, input: &Blocked, residual: Option<&Blocked>, outputs: &Outputs<'_>) {
        let shape = input.shape();
        assert_eq!(shape.channels, self.size.inputs, "channels of the input");
        assert_eq!(shape.width, self.width, "channels of a block");
        let stacks = [outputs.raw.as_deref(), outputs.relu.as_deref(), residual];
        let mut stacks = stacks.into_iter().flatten().map(Blocked::shape);
        let Some(out) = stacks.next() else {
            return;
        };
        assert_eq!(out.channels, self.size.outputs, "channels of the outputs");
        assert_eq!(out.width, BLOCK, "channels of a block");
        assert!(
            stacks.all(|stack| stack == out),
            "outputs and residual unlike each other"
        );
        let sides = out.sides();
        for (axis, size) in [shape.rows, shape.cols].into_iter().enumerate() {
            let pad = self.size.pad[axis];
            let last = sides[axis + 1].saturating_sub(1) * self.size.stride[axis];
            let end = last + self.size.kernel[axis];
            let has = size + shape.border;
            assert!(
                pad <= shape.border && end <= has + pad,
                "a border of {} for a kernel of {} at a padding of {pad}",
                shape.border,
                self.size.kernel[axis]
            );
        }
    }

    #[inline(always)]
    fn packed_weights(&self) -> &[f32] {
        flat(&self.weights)
    }

    /// Returns the weight between an input and an output of a 1 x 1 convolution.
    fn plain_weight(&self, output: usize, input: usize) -> f32 {
        let n_inputs = self.size.inputs.next_multiple_of(BLOCK);
        self.packed_weights()[(output / BLOCK * n_inputs + input) * BLOCK + output % BLOCK]
    }

    #[inline(always)]
    fn packed_bias(&self) -> &[f32] {
        flat(&self.bias)
    }
}

#[cfg(test)]
mod tests;
