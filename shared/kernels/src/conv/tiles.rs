//! Convolutions with 3 x 3 kernels in tiles of 2 x 2 outputs, with 16 products per tile instead of 36. The method is Winograd's minimal
//! filtering F(2x2, 3x3) (Lavin & Gray 2016, section 4.1). A tile of 4 x 4 inputs is transformed, then multiplied position by position with
//! the transformed kernel. The sums over the channels at one position are a 1 x 1 convolution in which the tiles take the place of the
//! pixels. A last transform gives the outputs of the tile.
#![expect(
    clippy::needless_range_loop,
    reason = "only ranges are unrolled surely, and that keeps values in registers"
)]

use super::blocked::BLOCK;
use super::fast::Layer;
use super::{Blocked, BlockedShape, Conv, ConvSize, Outputs};
use crate::isa::Isa;
use crate::simd::{Kernel, ROW, Row, Simd, flat_mut};

/// Positions in a transformed tile.
pub(super) const POSITIONS: usize = 16;
/// Rows and columns of outputs in a tile.
const STEP: usize = 2;
/// Rows and columns of inputs in a tile.
const SIDE: usize = 4;
/// Maximum number of tiles that are transformed at once, so that they stay in the second-level cache.
const MOST_TILES: usize = 32;

/// Memory for transformed tiles, kept from one convolution to the next.
#[derive(Debug, Default)]
pub struct Scratch {
    inputs: Vec<Row>,
    sums: Vec<Row>,
}

/// Returns the transformed kernels: one 1 x 1 convolution for each position.
///
/// * `weights`: `outputs x inputs x 3 x 3`.
pub(super) fn positions(size: ConvSize, weights: &[f32]) -> Vec<Vec<f32>> {
    let n = size.outputs * size.inputs;
    let mut all: Vec<_> = (0..POSITIONS).map(|_| Vec::with_capacity(n)).collect();
    for kernel in weights.chunks_exact(9) {
        let column = |col: usize| [0, 1, 2].map(|row| f64::from(kernel[3 * row + col]));
        let columns = [0, 1, 2].map(|col| kernel_to_positions(column(col)));
        for row in 0..SIDE {
            let values = kernel_to_positions(columns.map(|column| column[row]));
            for (col, value) in values.into_iter().enumerate() {
                all[SIDE * row + col].push(value as f32);
            }
        }
    }
    all
}

/// The transform of a row or column of a kernel.
fn kernel_to_positions([a, b, c]: [f64; 3]) -> [f64; SIDE] {
    [a, 0.5 * (a + b + c), 0.5 * (a - b + c), c]
}

/// Positions of tiles in a stack.
#[derive(Clone, Copy)]
struct Grid {
    from: BlockedShape,
    to: BlockedShape,
    pad: [usize; 2],
}

impl Grid {
    fn cols(&self) -> usize {
        self.to.cols.div_ceil(STEP)
    }

    fn n_tiles(&self) -> usize {
        self.to.rows.div_ceil(STEP) * self.cols()
    }

    /// Row and column of the first output of a tile.
    fn corner(&self, tile: usize) -> [usize; 2] {
        [tile / self.cols() * STEP, tile % self.cols() * STEP]
    }

    /// Offsets of the rows and of the columns of the inputs of a tile in a block. Offsets beyond the border are replaced by the end of the
    /// border; only outputs outside the stack depend on them.
    fn inputs(&self, tile: usize) -> [[usize; SIDE]; 2] {
        let from = self.from;
        let corner = self.corner(tile);
        let lengths = [from.rows, from.cols].map(|side| side + 2 * from.border);
        let steps = [from.row(), from.width];
        [0, 1].map(|axis| {
            [0, 1, 2, 3].map(|at| {
                let place = corner[axis] + at + from.border - self.pad[axis];
                place.min(lengths[axis] - 1) * steps[axis]
            })
        })
    }
}

pub(super) fn run(
    isa: Isa,
    conv: &Conv,
    (input, residual): (&Blocked, Option<&Blocked>),
    outputs: Outputs<'_>,
    scratch: &mut Scratch,
) {
    let Some(to) = outputs.shape() else {
        return;
    };
    let grid = Grid {
        from: input.shape(),
        to,
        pad: conv.size.pad,
    };
    let most = Strip {
        first: 0,
        n: grid.n_tiles().min(MOST_TILES),
    };
    let room = |shape: BlockedShape| (POSITIONS * most.stride(shape)).div_ceil(ROW);
    let grow = |rows: &mut Vec<Row>, n: usize| rows.resize(rows.len().max(n), Row::ZERO);
    grow(&mut scratch.inputs, room(grid.from));
    grow(&mut scratch.sums, room(grid.to));
    let Outputs { raw, relu } = outputs;
    isa.run(Tiles {
        conv,
        grid,
        input: input.values(),
        residual: residual.map(Blocked::values),
        raw: raw.map(Blocked::values_mut),
        relu: relu.map(Blocked::values_mut),
        inputs: flat_mut(&mut scratch.inputs),
        sums: flat_mut(&mut scratch.sums),
    });
}

struct Tiles<'a> {
    conv: &'a Conv,
    grid: Grid,
    input: &'a [f32],
    residual: Option<&'a [f32]>,
    raw: Option<&'a mut [f32]>,
    relu: Option<&'a mut [f32]>,
    /// Transformed inputs, in this order: position, block of channels, tile, channel of the block.
    inputs: &'a mut [f32],
    /// Sums, in the order of `inputs`.
    sums: &'a mut [f32],
}

/// Consecutive tiles.
#[derive(Clone, Copy)]
struct Strip {
    first: usize,
    n: usize,
}

impl Strip {
    fn shape(self, channels: usize) -> BlockedShape {
        BlockedShape::new([channels, 1, self.n], 0)
    }

    /// Floats from one position to the next. One block is left unused, so that the values of one tile at all positions are not in the same
    /// set of the first-level cache.
    fn stride(self, shape: BlockedShape) -> usize {
        (shape.n_blocks() * self.n + 1) * BLOCK
    }
}

impl Kernel for Tiles<'_> {
    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let n_tiles = self.grid.n_tiles();
        for first in (0..n_tiles).step_by(MOST_TILES) {
            let strip = Strip {
                first,
                n: MOST_TILES.min(n_tiles - first),
            };
            self.transform_inputs(simd, strip);
            let strides = [self.grid.from, self.grid.to].map(|shape| strip.stride(shape));
            for (position, conv) in self.conv.positions.iter().enumerate() {
                simd.apart(Layer {
                    conv,
                    from: strip.shape(self.grid.from.channels),
                    input: &self.inputs[position * strides[0]..],
                    residual: None,
                    shape: strip.shape(self.grid.to.channels),
                    raw: Some(&mut self.sums[position * strides[1]..]),
                    relu: None,
                });
            }
            self.transform_sums(simd, strip);
        }
    }
}

impl Tiles<'_> {
    #[inline(always)]
    fn transform_inputs<S: Simd>(&mut self, simd: S, strip: Strip) {
        let shape = self.grid.from;
        let stride = strip.stride(shape);
        let mut places = [[[0; SIDE]; 2]; MOST_TILES];
        for tile in 0..strip.n {
            places[tile] = self.grid.inputs(strip.first + tile);
        }
        for block in 0..shape.n_blocks() {
            for tile in 0..strip.n {
                let [rows, cols] = places[tile];
                for lane in (0..BLOCK).step_by(S::LANES) {
                    let begin = block * shape.plane() + lane;
                    let mut half = [[simd.splat(0.0); SIDE]; SIDE];
                    for col in 0..SIDE {
                        let mut column = [simd.splat(0.0); SIDE];
                        for row in 0..SIDE {
                            column[row] = simd.load(&self.input[begin + rows[row] + cols[col]..]);
                        }
                        let column = input_to_positions(simd, column);
                        for row in 0..SIDE {
                            half[row][col] = column[row];
                        }
                    }
                    let to = (block * strip.n + tile) * BLOCK + lane;
                    for row in 0..SIDE {
                        let values = input_to_positions(simd, half[row]);
                        for col in 0..SIDE {
                            let at = (SIDE * row + col) * stride + to;
                            simd.store(values[col], &mut self.inputs[at..]);
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn transform_sums<S: Simd>(&mut self, simd: S, strip: Strip) {
        let shape = self.grid.to;
        let stride = strip.stride(shape);
        for tile in 0..strip.n {
            let corner = self.grid.corner(strip.first + tile);
            for block in 0..shape.n_blocks() {
                for lane in (0..BLOCK).step_by(S::LANES) {
                    let begin = (block * strip.n + tile) * BLOCK + lane;
                    let mut half = [[simd.splat(0.0); SIDE]; STEP];
                    for col in 0..SIDE {
                        let mut column = [simd.splat(0.0); SIDE];
                        for row in 0..SIDE {
                            let at = (SIDE * row + col) * stride + begin;
                            column[row] = simd.load(&self.sums[at..]);
                        }
                        let column = sums_to_outputs(simd, column);
                        for row in 0..STEP {
                            half[row][col] = column[row];
                        }
                    }
                    let bias = simd.load(&self.conv.packed_bias()[block * BLOCK + lane..]);
                    for row in 0..STEP.min(shape.rows - corner[0]) {
                        let values = sums_to_outputs(simd, half[row]);
                        let at = shape.at(block, corner[0] + row, corner[1]) + lane;
                        for col in 0..STEP.min(shape.cols - corner[1]) {
                            self.write(simd, simd.add(bias, values[col]), at + col * BLOCK);
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn write<S: Simd>(&mut self, simd: S, mut value: S::V, at: usize) {
        if let Some(residual) = self.residual {
            value = simd.add(value, simd.load(&residual[at..]));
        }
        if let Some(raw) = &mut self.raw {
            simd.store(value, &mut raw[at..]);
        }
        if let Some(relu) = &mut self.relu {
            simd.store(simd.max(simd.splat(0.0), value), &mut relu[at..]);
        }
    }
}

/// The transform of a row or column of inputs.
#[inline(always)]
fn input_to_positions<S: Simd>(simd: S, [a, b, c, d]: [S::V; SIDE]) -> [S::V; SIDE] {
    [
        simd.sub(a, c),
        simd.add(b, c),
        simd.sub(c, b),
        simd.sub(b, d),
    ]
}

/// The outputs of a row or column of sums.
#[inline(always)]
fn sums_to_outputs<S: Simd>(simd: S, [a, b, c, d]: [S::V; SIDE]) -> [S::V; STEP] {
    let [first, second] = [simd.add(a, b), simd.sub(b, c)];
    [simd.add(first, c), simd.sub(second, d)]
}

/// Works like [`run`], but in plain loops.
pub(super) fn run_plain(
    conv: &Conv,
    (input, residual): (&Blocked, Option<&Blocked>),
    mut outputs: Outputs<'_>,
) {
    let Some(shape) = outputs.shape() else {
        return;
    };
    for channel in 0..shape.channels {
        for row in (0..shape.rows).step_by(STEP) {
            for col in (0..shape.cols).step_by(STEP) {
                let values = plain_tile(conv, input, channel, [row, col]);
                for (at, value) in values.into_iter().flatten().enumerate() {
                    let place = [row + at / STEP, col + at % STEP];
                    if place[0] < shape.rows && place[1] < shape.cols {
                        let mut value = conv.packed_bias()[channel] + value;
                        if let Some(residual) = residual {
                            value += residual.get(channel, place.map(Some));
                        }
                        outputs.set(channel, place, value);
                    }
                }
            }
        }
    }
}

/// The outputs of a tile, without the bias.
fn plain_tile(
    conv: &Conv,
    input: &Blocked,
    output: usize,
    corner: [usize; 2],
) -> [[f32; STEP]; STEP] {
    let mut sums = [[0.0_f32; SIDE]; SIDE];
    for channel in 0..input.shape().n_blocks() * BLOCK {
        let value = |row: usize, col: usize| {
            let place = [corner[0] + row, corner[1] + col];
            input.get(
                channel,
                [0, 1].map(|axis| place[axis].checked_sub(conv.size.pad[axis])),
            )
        };
        let rows = [0, 1, 2, 3];
        let columns = rows.map(|col| plain_positions(rows.map(|row| value(row, col))));
        for row in 0..SIDE {
            let values = plain_positions(columns.map(|column| column[row]));
            for col in 0..SIDE {
                let weight = conv.positions[SIDE * row + col].plain_weight(output, channel);
                sums[row][col] = values[col].mul_add(weight, sums[row][col]);
            }
        }
    }
    let columns = [0, 1, 2, 3].map(|col| plain_outputs(sums.map(|row| row[col])));
    [0, 1].map(|row| plain_outputs(columns.map(|column| column[row])))
}

fn plain_positions([a, b, c, d]: [f32; SIDE]) -> [f32; SIDE] {
    [a - c, b + c, c - b, b - d]
}

fn plain_outputs([a, b, c, d]: [f32; SIDE]) -> [f32; STEP] {
    [a + b + c, b - c - d]
}
