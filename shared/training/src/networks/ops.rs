//! The operations that networks are made of, and what a network is.

/// How the weights and outputs of a convolution are scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scaling {
    /// Weights and bias as they are.
    Plain,
    /// Weights are standardised: every channel has mean 0, the length that keeps the variance of positive parts, and a gain
    /// (Brock et al. 2021, "Characterizing signal propagation to close the performance gap in unnormalized `ResNets`").
    Standardised {
        /// Gain of every channel at the beginning.
        gain: f32,
    },
    /// Outputs are normalised over the batch, which has a shift in place of the bias.
    Batch,
}

/// A convolution, padded so that the size stays at stride 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conv {
    /// Output channels.
    pub channels: usize,
    /// Side of the square kernel, odd.
    pub kernel: usize,
    /// Step between two outputs.
    pub stride: usize,
    /// Depthwise: one filter for every channel; `channels` is the number of input channels.
    pub by_channel: bool,
    /// Scaling of weights and outputs.
    pub scaling: Scaling,
}

/// The places of parts in a list, and how far around them a network looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// Columns of the list with the places across the input, in heights of the input from its centre.
    pub x: Vec<usize>,
    /// Columns with the places down the input.
    pub y: Vec<usize>,
    /// Width of the input in its heights.
    pub width: f32,
    /// Deviation of the Gaussian around a place, cells of the map.
    pub deviation: f32,
}

/// Sizes of a value, without that of the batch: `[channels, rows, columns]` or `[values]`.
pub type Dims = Vec<usize>;

/// The operations that networks are made of: planning parameters, computing and writing ONNX implement them.
///
/// The first dimension of a value is the batch: maps are `[n, channels, rows, columns]`, lists `[n, values]`. Parameters are
/// used in the order of the calls, which is the same for every implementation.
pub trait Ops {
    /// A map or a list.
    type Value: Clone;

    /// The input of a name, see [`Network::inputs`].
    fn input(&mut self, name: &'static str) -> Self::Value;
    /// A list minus the fixed mean of every column, times its fixed factor.
    fn centred(&mut self, list: &Self::Value, name: &str) -> Self::Value;
    /// Convolves a map.
    fn conv(&mut self, map: &Self::Value, name: &str, conv: Conv) -> Self::Value;
    /// The positive part.
    fn relu(&mut self, value: &Self::Value) -> Self::Value;
    /// The sum of two values of one shape.
    fn add(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// A map with every cell doubled across and down.
    fn doubled(&mut self, map: &Self::Value) -> Self::Value;
    /// The largest of every 2 x 2 cells of a map.
    fn pool(&mut self, map: &Self::Value) -> Self::Value;
    /// The mean of every channel of a map: a list.
    fn mean(&mut self, map: &Self::Value) -> Self::Value;
    /// The largest value of every channel of a map: a list.
    fn highest(&mut self, map: &Self::Value) -> Self::Value;
    /// A map as a list.
    fn flat(&mut self, map: &Self::Value) -> Self::Value;
    /// A value through which nothing is learned.
    fn fixed(&mut self, value: &Self::Value) -> Self::Value;
    /// The softmax over the cells of every map times `sharpness`: weights around its maximum.
    fn softmax(&mut self, maps: &Self::Value, sharpness: f32) -> Self::Value;
    /// Gaussian weights around places in a list, one map a place, of the size of the map `like`.
    ///
    /// Nothing is learned through them.
    fn around(&mut self, list: &Self::Value, like: &Self::Value, places: &Places) -> Self::Value;
    /// The sums of the channels of a map with the weights of every map of `weights`: a list of the channels by the first, by
    /// the second, and so on.
    fn look(&mut self, map: &Self::Value, weights: &Self::Value) -> Self::Value;
    /// The means of places with the weights of maps: a list of x, y and x² + y² by the first map, by the second, and so on; x
    /// and y as `grid` says.
    fn place(&mut self, weights: &Self::Value) -> Self::Value;
    /// Concatenates lists, or the channels of maps of one size.
    fn join(&mut self, lists: &[&Self::Value]) -> Self::Value;
    /// A dense layer with bias.
    fn dense(&mut self, list: &Self::Value, name: &str, values: usize) -> Self::Value;
    /// `ReLU` with a learned slope for negative values, one a value of the list.
    fn prelu(&mut self, list: &Self::Value, name: &str) -> Self::Value;
    /// While training, sets this share of the values of a list to 0 and enlarges the others.
    fn dropout(&mut self, list: &Self::Value, share: f32) -> Self::Value;
}

/// An output of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Output {
    /// Its name in the ONNX file.
    pub name: &'static str,
    /// True if the network gives natural logarithms, whose exponentials the file gives.
    pub is_logarithm: bool,
}

/// A network, defined once for all that is done with it.
pub trait Network {
    /// Names and sizes of its inputs.
    fn inputs(&self) -> Vec<(&'static str, Dims)>;
    /// Its outputs, in the order of [`Self::run`].
    fn outputs(&self) -> Vec<Output>;
    /// Runs it.
    fn run<O: Ops>(&self, ops: &mut O) -> Vec<O::Value>;
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

/// The cells along one side of a map, for weights around a place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Along {
    /// Where their centres lie, heights of the input from its centre.
    pub(crate) centres: Vec<f32>,
    /// Factor of the squared distance from a centre before the exponential.
    pub(crate) factor: f32,
}

impl Along {
    /// The cells along a side of some length, heights of the input; `deviation` in cells.
    pub(crate) fn new(cells: usize, side: f32, deviation: f32) -> Self {
        let cell = side / cells as f32;
        let centre = |at: usize| (at as f32 + 0.5) * cell - 0.5 * side;
        Self {
            centres: (0..cells).map(centre).collect(),
            factor: -0.5 / (deviation * cell).powi(2),
        }
    }

    /// The weight of every cell around a place.
    pub(crate) fn weights(&self, place: f32) -> impl Iterator<Item = f32> {
        let weight = move |centre: &f32| ((place - centre).powi(2) * self.factor).exp();
        self.centres.iter().map(weight)
    }
}

/// Dimensions of the output of a convolution.
pub(crate) fn convolved(map: &[usize], conv: Conv) -> Dims {
    let side = |length: usize| (length - 1) / conv.stride + 1;
    vec![conv.channels, side(map[1]), side(map[2])]
}

/// Dimensions of what is concatenated.
pub(crate) fn joined(parts: &[&[usize]]) -> Dims {
    let mut dims = parts.first().map_or_else(Dims::new, |first| first.to_vec());
    if let Some(channels) = dims.first_mut() {
        *channels = parts.iter().map(|part| part[0]).sum();
    }
    dims
}
