//! The network, defined once: planning parameters, running and writing ONNX are implementations of [`Ops`].
//!
//! One picture of a person goes in; three things come out: a map of log-odds for every joint, the evidence for the
//! direction in which the trunk faces, and the expected error of every joint.
//!
//! Convolutions are followed by no normalisation over the batch. Their weights are standardised instead (Brock et al. 2021,
//! "Characterizing signal propagation to close the performance gap in unnormalized `ResNets`"), and every residual block begins
//! as the identity.

use skeleton::PARSE14;

/// Joints that have a map: those of [`PARSE14`], in its order.
pub const N_JOINTS: usize = PARSE14.joints.len();

/// Pixels of the input for a cell of the maps.
pub const STRIDE: usize = 4;

/// What sides of the input must be multiples of.
pub(crate) const MULTIPLE: usize = 32;

/// How much the logits of a map are sharpened where features are looked up at its maximum.
const SHARPNESS: f32 = 2.0;
/// How much they are sharpened where lower maxima should count, too.
const WIDE: f32 = 1.0;

/// A convolution with a bias, padded so that the size stays at stride 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Conv {
    /// Output channels.
    pub(crate) channels: usize,
    /// Side of the square kernel, odd.
    pub(crate) kernel: usize,
    /// Step between two outputs.
    pub(crate) stride: usize,
    /// The factor of every channel at the beginning.
    pub(crate) gain: f32,
}

/// The operations that the network is made of.
///
/// The first dimension of a value is the batch: maps are `[n, channels, rows, columns]`, lists `[n, values]`. Parameters are
/// used in the order of the calls, which is the same for every implementation.
pub(crate) trait Ops {
    /// A map or a list.
    type Value: Clone;

    /// The input: a map of 3 channels.
    fn picture(&mut self) -> Self::Value;
    /// Convolves a map with standardised weights.
    fn conv(&mut self, of: &Self::Value, name: &str, conv: Conv) -> Self::Value;
    /// The positive part.
    fn relu(&mut self, of: &Self::Value) -> Self::Value;
    /// The sum of two values of one shape.
    fn add(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// A map with every cell doubled across and down.
    fn doubled(&mut self, of: &Self::Value) -> Self::Value;
    /// The mean of every channel of a map: a list.
    fn mean(&mut self, of: &Self::Value) -> Self::Value;
    /// A value through which nothing is learned.
    fn fixed(&mut self, of: &Self::Value) -> Self::Value;
    /// The mean of the channels of a map around the maxima of other maps of its size: a list of the channels at the first
    /// maximum, at the second, and so on.
    ///
    /// The weights are the softmax over the cells of `maps` times `sharpness`.
    fn look(&mut self, of: &Self::Value, maps: &Self::Value, sharpness: f32) -> Self::Value;
    /// Where the maxima of maps are: a list of x, y and x² + y² of the first maximum, of the second, and so on.
    ///
    /// The means over the cells with the weights of [`Self::look`]; x and y as [`grid`] says.
    fn place(&mut self, maps: &Self::Value, sharpness: f32) -> Self::Value;
    /// The largest value of every channel of a map: a list.
    fn highest(&mut self, of: &Self::Value) -> Self::Value;
    /// Concatenates lists.
    fn join(&mut self, of: &[&Self::Value]) -> Self::Value;
    /// A dense layer with bias.
    fn dense(&mut self, of: &Self::Value, name: &str, values: usize) -> Self::Value;
}

/// The sizes of the network.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Shape {
    /// Width of the input, pixels: a multiple of 32.
    pub width: usize,
    /// Its height.
    pub height: usize,
    /// Channels of the first layer.
    pub stem: usize,
    /// Channels at strides 4, 8, 16 and 32.
    pub channels: [usize; 4],
    /// Residual blocks at these strides.
    pub blocks: [usize; 4],
    /// Values of the hidden layers of the direction and of the expected error.
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
    /// The same network for a smaller input, by 32 pixels across and down where that leaves anything.
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

/// What the network gives.
#[derive(Debug, Clone)]
pub(crate) struct Outputs<V> {
    /// Log-odds of every joint in every cell: a map of [`N_JOINTS`] channels.
    pub(crate) maps: V,
    /// Evidence for the direction of the trunk: a list of 2, towards the right of the picture and towards the camera.
    /// Twice its scalar product with a direction is the log-likelihood ratio of facing there over facing away from there.
    pub(crate) front: V,
    /// Natural logarithm of the expected error of every joint, heights of the input: a list of [`N_JOINTS`].
    pub(crate) error: V,
}

/// Runs the network.
pub(crate) fn run<O: Ops>(ops: &mut O, shape: &Shape) -> Outputs<O::Value> {
    let picture = ops.picture();
    let stem = ops.conv(&picture, "stem1", plain(shape.stem, 3, 2));
    let stem = ops.relu(&stem);
    let mut at = ops.conv(&stem, "stem2", plain(shape.channels[0], 3, 2));
    let mut levels = Vec::new();
    for (level, (&channels, &blocks)) in shape.channels.iter().zip(&shape.blocks).enumerate() {
        if level > 0 {
            let active = ops.relu(&at);
            at = ops.conv(&active, &format!("down{level}"), plain(channels, 3, 2));
        }
        for nth in 0..blocks {
            at = block(
                ops,
                &at,
                &format!("level{level}.{nth}"),
                [channels, channels / 2],
            );
        }
        levels.push(at.clone());
    }
    let deepest = ops.relu(&at);
    for level in (0..shape.channels.len() - 1).rev() {
        let channels = shape.channels[level];
        let active = ops.relu(&at);
        let narrowed = ops.conv(&active, &format!("up{level}"), plain(channels, 1, 1));
        let enlarged = ops.doubled(&narrowed);
        at = ops.add(&levels[level], &enlarged);
        let hidden = if level == 0 { channels } else { channels / 2 };
        for nth in 0..if level == 0 { 2 } else { 1 } {
            at = block(
                ops,
                &at,
                &format!("refine{level}.{nth}"),
                [channels, hidden],
            );
        }
    }
    let features = ops.relu(&at);
    let head = Conv {
        gain: 0.1,
        ..plain(N_JOINTS, 1, 1)
    };
    let maps = ops.conv(&features, "maps", head);
    let places = ops.fixed(&maps);
    let overall = ops.mean(&deepest);
    let front = front(ops, shape, [&features, &places, &overall]);
    let error = error(ops, shape, [&features, &places, &overall]);
    Outputs { maps, front, error }
}

fn plain(channels: usize, kernel: usize, stride: usize) -> Conv {
    Conv {
        channels,
        kernel,
        stride,
        gain: 1.0,
    }
}

/// A residual block: narrowed, convolved, widened, added.
fn block<O: Ops>(
    ops: &mut O,
    of: &O::Value,
    name: &str,
    [channels, hidden]: [usize; 2],
) -> O::Value {
    let x = ops.relu(of);
    let x = ops.conv(&x, &format!("{name}.narrow"), plain(hidden, 1, 1));
    let x = ops.relu(&x);
    let x = ops.conv(&x, &format!("{name}.inner"), plain(hidden, 3, 1));
    let x = ops.relu(&x);
    let widen = Conv {
        gain: 0.0,
        ..plain(channels, 1, 1)
    };
    let x = ops.conv(&x, &format!("{name}.widen"), widen);
    ops.add(of, &x)
}

/// x, y and x² + y² of every cell, row by row: -1 to 1 from the left to the right, and from the top down.
pub(crate) fn grid(columns: usize, rows: usize) -> Vec<f32> {
    let middle = |at: usize, n: usize| (2 * at + 1) as f32 / n as f32 - 1.0;
    let mut all = Vec::with_capacity(3 * columns * rows);
    for row in 0..rows {
        for column in 0..columns {
            let [x, y] = [middle(column, columns), middle(row, rows)];
            all.extend([x, y, x * x + y * y]);
        }
    }
    all
}

/// By the features at the joints and the deepest features of the whole picture.
fn front<O: Ops>(
    ops: &mut O,
    shape: &Shape,
    [features, places, overall]: [&O::Value; 3],
) -> O::Value {
    let seen = ops.look(features, places, SHARPNESS);
    let all = ops.join(&[&seen, overall]);
    let hidden = ops.dense(&all, "front1", shape.hidden);
    let hidden = ops.relu(&hidden);
    ops.dense(&hidden, "front2", 2)
}

/// The same, from which the features learn nothing, and how high the maps are, where, and how far their heat is spread.
fn error<O: Ops>(
    ops: &mut O,
    shape: &Shape,
    [features, places, overall]: [&O::Value; 3],
) -> O::Value {
    let features = ops.fixed(features);
    let overall = ops.fixed(overall);
    let seen = ops.look(&features, places, SHARPNESS);
    let heights = ops.highest(places);
    let near = ops.place(places, SHARPNESS);
    let wide = ops.place(places, WIDE);
    let all = ops.join(&[&seen, &heights, &near, &wide, &overall]);
    let hidden = ops.dense(&all, "error1", shape.hidden);
    let hidden = ops.relu(&hidden);
    ops.dense(&hidden, "error2", N_JOINTS)
}
