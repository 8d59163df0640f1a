//! The network that finds people.
//!
//! The input is a whole picture. For every cell of four by four pixels, the output has the log-odds that the cell contains the middle of a
//! person's box. It also has the natural logarithms of the distances from the centre of the cell to the left, top, right and
//! bottom of that box, in cells.

use crate::networks::begun::{self, BeginError};
use crate::networks::ops::{Dims, Network, Ops, Output};
use crate::networks::parameters::{self, Parameter};
use crate::networks::trunk::{Trunk, plain, with_gain};

/// Pixels of the input per cell of the output.
pub const STRIDE: usize = 4;
/// Values per cell: the log-odds and four sides.
pub const CHANNELS: usize = 5;
/// Name of the input, `[n, 3, height, width]`.
pub const PICTURE: &str = "picture";
/// Name of the output, `[n, 5, rows, columns]`.
pub const BOXES: &str = "boxes";
/// Sides of the input are multiples of this number.
pub(crate) const MULTIPLE: usize = 32;

/// The log-odds that an untrained network gives for every cell.
const HEAT_BIAS: f32 = -4.6;
/// Logarithms of the distances to the sides, in cells, that an untrained network gives: a person one third as high as the picture.
const SIDE_BIAS: [f32; 4] = [1.4, 2.3, 1.4, 2.3];

/// The sizes of the network.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Shape {
    /// Side of the square input, in pixels: a multiple of 32.
    pub side: usize,
    /// Number of channels of the first layer.
    pub stem: usize,
    /// Numbers of channels at strides 4, 8, 16 and 32.
    pub channels: [usize; 4],
    /// Numbers of residual blocks at strides 4, 8, 16 and 32.
    pub blocks: [usize; 4],
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            side: 256,
            stem: 16,
            channels: [32, 64, 96, 128],
            blocks: [1, 2, 3, 3],
        }
    }
}

impl Shape {
    /// The same network for an input with three quarters of the side.
    #[must_use]
    pub fn smaller(&self) -> Self {
        let side = (self.side * 3 / 4 / MULTIPLE * MULTIPLE).max(MULTIPLE);
        Self {
            side,
            ..self.clone()
        }
    }

    /// Number of columns, and of rows, of the output.
    pub fn cells(&self) -> usize {
        self.side / STRIDE
    }
}

impl Network for Shape {
    fn inputs(&self) -> Vec<(&'static str, Dims)> {
        vec![(PICTURE, vec![3, self.side, self.side])]
    }

    fn outputs(&self) -> Vec<Output> {
        vec![Output {
            name: BOXES,
            is_logarithm: false,
        }]
    }

    fn run<O: Ops>(&self, ops: &mut O) -> Vec<O::Value> {
        let trunk = Trunk {
            stem: self.stem,
            channels: self.channels,
            blocks: self.blocks,
            refined: 1,
            hidden: self.channels[0] / 2,
        };
        let picture = ops.input(PICTURE);
        let [features, _] = trunk.run(ops, &picture);
        let features = ops.relu(&features);
        vec![ops.conv(&features, BOXES, with_gain(0.1, plain(CHANNELS, 1, 1)))]
    }
}

/// The parameters of an untrained network, which finds no people.
pub fn initial(shape: &Shape, seed: u64) -> Vec<Parameter> {
    let mut all = parameters::initial(shape, seed);
    let bias = all.iter_mut().find(|parameter| parameter.name == "boxes.bias");
    if let Some(bias) = bias {
        bias.values[0] = HEAT_BIAS;
        bias.values[1..].copy_from_slice(&SIDE_BIAS);
    }
    all
}

/// Reads the parameters of a network that [`Trainer::onnx`](crate::networks::Trainer::onnx) wrote, from which a training run starts.
///
/// * `shape`: sizes of the network. The side of the input may differ from that of the file.
/// * `seed`: seed for the initial weights of channels whose weights in the file are all 0.
///
/// # Errors
///
/// Fails with [`BeginError`].
pub fn begun(shape: &Shape, seed: u64, file: &[u8]) -> Result<Vec<Parameter>, BeginError> {
    begun::begun(initial(shape, seed), file)
}
