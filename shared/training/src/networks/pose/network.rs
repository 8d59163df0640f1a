//! The network that finds joints.
//!
//! The input is a picture of one person. There are three outputs: a map of log-odds for every keypoint, the evidence for the
//! direction in which the trunk faces, and the expected error of every keypoint.
//!
//! The maps of the [extra keypoints](EXTRAS) are computed from the same features as the joints, by a few separate layers. These layers can
//! be trained alone.

use skeleton::PARSE14;

use crate::networks::begun::BeginError;
use crate::networks::ops::{Dims, Network, Ops, Output};
use crate::networks::parameters::{self, Parameter};
use crate::networks::trunk::{Trunk, block, plain, with_gain};

/// Number of joints with a map: all joints of [`PARSE14`], in its order.
pub const N_JOINTS: usize = PARSE14.joints.len();
/// Names of the keypoints whose maps follow those of the joints.
pub const EXTRAS: [&str; 5] = [
    "nose",
    "left heel",
    "right heel",
    "left big toe",
    "right big toe",
];
/// Number of keypoints with a map: the joints, then [`EXTRAS`].
pub const N_KEYPOINTS: usize = N_JOINTS + EXTRAS.len();

/// Pixels of the input per cell of the maps.
pub const STRIDE: usize = 4;

/// The sides of the input must be multiples of this number.
pub(crate) const MULTIPLE: usize = 32;

/// Factor by which the logits of a map are multiplied in the softmax that selects features at the maximum of the map.
const SHARPNESS: f32 = 2.0;
/// Factor by which the logits are multiplied in the softmax in which lower maxima should also count.
const WIDE: f32 = 1.0;

/// The log-odds that an untrained network gives for every cell of a map.
const MAP_BIAS: f32 = -4.0;
/// The logarithm of the expected error before training: a tenth of the input's height.
const ERROR_BIAS: f32 = -2.3;

/// The sizes of the network.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Shape {
    /// Width of the input in pixels: a multiple of 32.
    pub width: usize,
    /// Height of the input in pixels: a multiple of 32.
    pub height: usize,
    /// Number of channels of the first layer.
    pub stem: usize,
    /// Numbers of channels at strides 4, 8, 16 and 32.
    pub channels: [usize; 4],
    /// Numbers of residual blocks at strides 4, 8, 16 and 32.
    pub blocks: [usize; 4],
    /// Size of the hidden layers for the direction and for the expected error.
    pub hidden: usize,
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            width: 128,
            height: 160,
            stem: 32,
            channels: [64, 128, 192, 256],
            blocks: [2, 3, 6, 4],
            hidden: 96,
        }
    }
}

impl Shape {
    /// The same network for an input that is 32 pixels smaller across and down, if the input is large enough for that.
    #[must_use]
    pub fn smaller(&self) -> Self {
        let less = |side: usize| side.saturating_sub(MULTIPLE).max(MULTIPLE);
        Self {
            width: less(self.width),
            height: less(self.height),
            ..self.clone()
        }
    }

    /// Columns and rows of the maps.
    pub fn cells(&self) -> [usize; 2] {
        [self.width / STRIDE, self.height / STRIDE]
    }
}

/// Name of the input, `[n, 3, height, width]`.
pub const PICTURE: &str = "picture";
/// Name of the output with the log-odds of every keypoint in every cell, `[n, keypoints, rows, columns]`.
pub const MAPS: &str = "maps";
/// Name of the output with the evidence for the direction of the trunk, `[n, 2]`: components towards the right of the picture and towards
/// the camera.
///
/// Twice the scalar product of the evidence with a direction is the log-likelihood ratio between facing in this direction and facing in the
/// opposite one.
pub const FRONT: &str = "front";
/// Name of the output with the expected errors of the keypoints, in heights of the input, `[n, keypoints]`.
pub const ERROR: &str = "error";

impl Network for Shape {
    fn inputs(&self) -> Vec<(&'static str, Dims)> {
        vec![(PICTURE, vec![3, self.height, self.width])]
    }

    fn outputs(&self) -> Vec<Output> {
        let output = |name, is_logarithm| Output { name, is_logarithm };
        vec![
            output(MAPS, false),
            output(FRONT, false),
            output(ERROR, true),
        ]
    }

    fn run<O: Ops>(&self, ops: &mut O) -> Vec<O::Value> {
        run(ops, self)
    }
}

/// The parameters of an untrained network. Before training, its outputs for the direction and the errors are values that are plausible for
/// any person.
pub fn initial(shape: &Shape, seed: u64) -> Vec<Parameter> {
    let mut all = parameters::initial(shape, seed);
    for parameter in &mut all {
        match parameter.name.as_str() {
            "maps.bias" | "extra_maps.bias" => parameter.values.fill(MAP_BIAS),
            "error2.bias" | "extra_error2.bias" => parameter.values.fill(ERROR_BIAS),
            "error2.weight" | "extra_error2.weight" | "front2.weight" => {
                parameter.values.fill(0.0);
            }
            _ => (),
        }
    }
    all
}

/// Reads the parameters of a network that [`file()`](super::file()) wrote, from which a training run starts.
///
/// * `shape`: sizes of the network. Width and height of the input may differ from those of the file.
/// * `seed`: seed for the initial weights of channels whose weights in the file are all 0.
///
/// # Errors
///
/// Fails with [`BeginError`].
pub fn begun(shape: &Shape, seed: u64, file: &[u8]) -> Result<Vec<Parameter>, BeginError> {
    crate::networks::begun::begun(initial(shape, seed), file)
}

/// Runs the network. Returns the maps, the evidence for the direction, and the logarithms of the expected errors.
fn run<O: Ops>(ops: &mut O, shape: &Shape) -> Vec<O::Value> {
    let trunk = Trunk {
        stem: shape.stem,
        channels: shape.channels,
        blocks: shape.blocks,
        refined: 2,
        hidden: shape.channels[0],
    };
    let picture = ops.input(PICTURE);
    let [at, deepest] = trunk.run(ops, &picture);
    let features = ops.relu(&at);
    let head = with_gain(0.1, plain(N_JOINTS, 1, 1));
    let maps = ops.conv(&features, "maps", head);
    let places = ops.fixed(&maps);
    let overall = ops.mean(&deepest);
    let front = front(ops, shape, [&features, &places, &overall]);
    let joints = ("", [shape.hidden, N_JOINTS]);
    let errors = error(ops, joints, [&features, &places, &overall]);
    let channels = shape.channels[0];
    let own = block(ops, &at, "extra_refine", [channels, channels / 2]);
    let own = ops.relu(&own);
    let head = with_gain(0.1, plain(EXTRAS.len(), 1, 1));
    let extras = ops.conv(&own, "extra_maps", head);
    let places = ops.fixed(&extras);
    let keypoints = ("extra_", [shape.hidden, EXTRAS.len()]);
    let of_extras = error(ops, keypoints, [&own, &places, &overall]);
    let maps = ops.join(&[&maps, &extras]);
    let errors = ops.join(&[&errors, &of_extras]);
    vec![maps, front, errors]
}

/// Computes the direction from the features at the joints and the deepest features of the whole picture.
fn front<O: Ops>(
    ops: &mut O,
    shape: &Shape,
    [features, places, overall]: [&O::Value; 3],
) -> O::Value {
    let weights = ops.softmax(places, SHARPNESS);
    let seen = ops.look(features, &weights);
    let all = ops.join(&[&seen, overall]);
    let hidden = ops.dense(&all, "front1", shape.hidden);
    let hidden = ops.relu(&hidden);
    ops.dense(&hidden, "front2", 2)
}

/// Computes the expected errors from the same features, and from the heights, positions and spreads of the maps. No gradient flows
/// back to the features.
///
/// * `name`: prefix of the names of the layers.
/// * `hidden`, `n`: size of the hidden layer, and number of keypoints.
/// * `places`: the maps of the keypoints.
fn error<O: Ops>(
    ops: &mut O,
    (name, [hidden, n]): (&str, [usize; 2]),
    [features, places, overall]: [&O::Value; 3],
) -> O::Value {
    let features = ops.fixed(features);
    let overall = ops.fixed(overall);
    let [near, wide] = [SHARPNESS, WIDE].map(|sharpness| ops.softmax(places, sharpness));
    let seen = ops.look(&features, &near);
    let heights = ops.highest(places);
    let near = ops.place(&near);
    let wide = ops.place(&wide);
    let all = ops.join(&[&seen, &heights, &near, &wide, &overall]);
    let hidden = ops.dense(&all, &format!("{name}error1"), hidden);
    let hidden = ops.relu(&hidden);
    ops.dense(&hidden, &format!("{name}error2"), n)
}
