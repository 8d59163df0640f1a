//! Sums of two stacks of channels, one of which may have a lower resolution.

use super::{Blocked, Outputs, relu};
use crate::dispatch::{Body, dispatch};
use crate::isa::Isa;

/// Writes `a + b`, with each pixel of `b` repeated over `repeat x repeat` pixels.
///
/// # Panics
///
/// Panics if the sizes of the repeated `b` or of the outputs differ from those of `a`.
pub fn add_repeated(isa: Isa, a: &Blocked, b: &Blocked, repeat: usize, outputs: Outputs<'_>) {
    let [channels, rows, cols] = b.shape().sides();
    let sides = [channels, rows * repeat, cols * repeat];
    assert_eq!(a.shape().sides(), sides, "sides of a sum");
    assert_eq!(outputs.sides(), [sides; 2], "sides of a sum");
    let Outputs { raw, relu } = outputs;
    let with = |to, is_relu| Sum {
        stacks: (a, b),
        repeat,
        to,
        is_relu,
    };
    if let Some(to) = raw {
        dispatch(isa, with(to, false));
    }
    if let Some(to) = relu {
        dispatch(isa, with(to, true));
    }
}

struct Sum<'a> {
    stacks: (&'a Blocked, &'a Blocked),
    repeat: usize,
    to: &'a mut Blocked,
    is_relu: bool,
}

impl Body for Sum<'_> {
    #[inline(always)]
    fn run(self) {
        let (a, b) = self.stacks;
        let (from, coarse, shape) = (a.shape(), b.shape(), self.to.shape());
        for block in 0..shape.n_blocks() {
            for row in 0..shape.rows {
                let n = shape.cols * shape.width;
                let a = &a.values()[from.at(block, row, 0)..][..n];
                let b = &b.values()[coarse.at(block, row / self.repeat, 0)..];
                let to = &mut self.to.values_mut()[shape.at(block, row, 0)..][..n];
                let pixels = to.chunks_exact_mut(shape.width);
                let pixels = pixels.zip(a.chunks_exact(shape.width));
                for (col, (to, a)) in pixels.enumerate() {
                    let b = &b[col / self.repeat * shape.width..][..shape.width];
                    for ((to, a), b) in to.iter_mut().zip(a).zip(b) {
                        let sum = a + b;
                        *to = if self.is_relu { relu(sum) } else { sum };
                    }
                }
            }
        }
    }
}
