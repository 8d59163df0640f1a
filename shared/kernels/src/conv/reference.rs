//! Convolutions in plain loops.

use super::blocked::BLOCK;
use super::{Blocked, Conv, Outputs};

/// Computes each output separately.
pub(super) fn run(
    conv: &Conv,
    input: &Blocked,
    residual: Option<&Blocked>,
    mut outputs: Outputs<'_>,
) {
    let [[channels, rows, cols], _] = outputs.sides();
    for channel in 0..channels {
        for row in 0..rows {
            for col in 0..cols {
                let mut value = value(conv, input, channel, [row, col]);
                if let Some(residual) = residual {
                    value += residual.get(channel, [Some(row), Some(col)]);
                }
                outputs.set(channel, [row, col], value);
            }
        }
    }
}

fn value(conv: &Conv, input: &Blocked, output: usize, at: [usize; 2]) -> f32 {
    let size = conv.size;
    let [rows, cols] = size.kernel;
    let width = conv.width;
    let n_blocks = size.inputs.div_ceil(width);
    let mut weight = output / BLOCK * n_blocks * rows * cols * width * BLOCK + output % BLOCK;
    let mut sum = conv.packed_bias()[output];
    for block in 0..n_blocks {
        for row in 0..rows {
            for col in 0..cols {
                let from = [row, col].into_iter().enumerate();
                let from = from.map(|(axis, tap)| {
                    (at[axis] * size.stride[axis] + tap).checked_sub(size.pad[axis])
                });
                let from: Vec<Option<usize>> = from.collect();
                for lane in 0..width {
                    let value = input.get(block * width + lane, [from[0], from[1]]);
                    sum = value.mul_add(conv.packed_weights()[weight], sum);
                    weight += BLOCK;
                }
            }
        }
    }
    sum
}
