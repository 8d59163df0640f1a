//! The operations that networks consist of, and the definition of a network.

/// Scaling of the weights and outputs of a convolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scaling {
    /// No scaling of weights and bias.
    Plain,
    /// Weights are standardised: the weights of every channel have mean 0 and a length that preserves the variance through a `ReLU`, and
    /// are multiplied by a gain (Brock et al. 2021, "Characterizing signal propagation to close the performance gap in unnormalized
    /// `ResNets`").
    Standardised {
        /// Initial gain of every channel.
        gain: f32,
    },
    /// Outputs are normalised over the batch; the normalisation has a shift that replaces the bias.
    Batch,
}

/// A convolution, padded such that stride 1 keeps the size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conv {
    /// Number of output channels.
    pub channels: usize,
    /// Side of the square kernel; odd.
    pub kernel: usize,
    /// Step between neighbouring outputs.
    pub stride: usize,
    /// True for a depthwise convolution, with one filter for every channel; `channels` is then the number of input channels.
    pub by_channel: bool,
    /// Scaling of weights and outputs.
    pub scaling: Scaling,
}

/// Positions of parts in a list, and the area around them that a network uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Places {
    /// Columns of the list with the horizontal positions, relative to the centre of the input and as multiples of its height.
    pub x: Vec<usize>,
    /// Columns of the list with the vertical positions, relative to the centre of the input and as multiples of its height.
    pub y: Vec<usize>,
    /// Aspect ratio of the input: its width divided by its height.
    pub width: f32,
    /// Standard deviation of the Gaussian around a position, in cells of the map.
    pub deviation: f32,
}

/// Dimensions of a value without the batch: `[channels, rows, columns]` or `[values]`.
pub type Dims = Vec<usize>;

/// The operations that networks consist of. They are implemented for planning parameters, for computing, and for writing ONNX.
///
/// The first dimension of a value is the batch: maps are `[n, channels, rows, columns]`, lists `[n, values]`. Parameters are
/// used in the order of the calls, which is the same for every implementation.
pub trait Ops {
    /// A map or a list.
    type Value: Clone;

    /// Returns the input with a given name, see [`Network::inputs`].
    fn input(&mut self, name: &'static str) -> Self::Value;
    /// Subtracts the fixed mean of every column of a list, and multiplies by the column's fixed factor.
    fn centred(&mut self, list: &Self::Value, name: &str) -> Self::Value;
    /// Convolves a map.
    fn conv(&mut self, map: &Self::Value, name: &str, conv: Conv) -> Self::Value;
    /// Replaces negative values with 0.
    fn relu(&mut self, value: &Self::Value) -> Self::Value;
    /// Adds two values of the same shape.
    fn add(&mut self, a: &Self::Value, b: &Self::Value) -> Self::Value;
    /// Doubles every cell of a map across and down.
    fn doubled(&mut self, map: &Self::Value) -> Self::Value;
    /// Returns the largest value of every block of 2 x 2 cells of a map.
    fn pool(&mut self, map: &Self::Value) -> Self::Value;
    /// Returns the mean of every channel of a map, as a list.
    fn mean(&mut self, map: &Self::Value) -> Self::Value;
    /// Returns the largest value of every channel of a map, as a list.
    fn highest(&mut self, map: &Self::Value) -> Self::Value;
    /// Returns the values of a map as a list.
    fn flat(&mut self, map: &Self::Value) -> Self::Value;
    /// Returns the same value without a gradient, so that the operations before it are not trained by this use of the value.
    fn fixed(&mut self, value: &Self::Value) -> Self::Value;
    /// Multiplies the maps by `sharpness`, and returns the softmax over the cells of each map: weights that are largest around the map's
    /// maximum.
    fn softmax(&mut self, maps: &Self::Value, sharpness: f32) -> Self::Value;
    /// Gaussian weights around the positions in a list: one map for each position, of the size of the map `like`.
    ///
    /// The weights have no gradient.
    fn around(&mut self, list: &Self::Value, like: &Self::Value, places: &Places) -> Self::Value;
    /// Weighted sums of every channel over the cells of a map, for each map in `weights`. The result is a list: all channels for the first
    /// weights, then all channels for the second, and so on.
    fn look(&mut self, map: &Self::Value, weights: &Self::Value) -> Self::Value;
    /// Weighted means of the cell positions, for each map of weights. The result is a list of x, y and x² + y² for the first map, then for
    /// the second, and so on. `grid` defines x and y.
    fn place(&mut self, weights: &Self::Value) -> Self::Value;
    /// Concatenates lists, or the channels of maps of the same size.
    fn join(&mut self, lists: &[&Self::Value]) -> Self::Value;
    /// A dense layer with bias.
    fn dense(&mut self, list: &Self::Value, name: &str, values: usize) -> Self::Value;
    /// `ReLU` with a learned slope for negative values; each value of the list has its own slope.
    fn prelu(&mut self, list: &Self::Value, name: &str) -> Self::Value;
    /// During training, sets this share of the values of a list to 0 and scales up the others.
    fn dropout(&mut self, list: &Self::Value, share: f32) -> Self::Value;
}

/// An output of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Output {
    /// Name of the output in the ONNX file.
    pub name: &'static str,
    /// True if the network returns natural logarithms; the ONNX file then returns their exponentials.
    pub is_logarithm: bool,
}

/// A network, defined once for training, running and writing it.
pub trait Network {
    /// Names and dimensions of the inputs.
    fn inputs(&self) -> Vec<(&'static str, Dims)>;
    /// Outputs, in the order of [`Self::run`].
    fn outputs(&self) -> Vec<Output>;
    /// Runs the network with the given implementation of the operations.
    fn run<O: Ops>(&self, ops: &mut O) -> Vec<O::Value>;
}

/// Returns x, y and x² + y² of every cell, row by row. x increases from -1 to 1 from left to right, and y from top to bottom.
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

/// The cells along one side of a map, for weights around a position.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Along {
    /// Positions of the cell centres, relative to the centre of the input and as multiples of its height.
    pub(crate) centres: Vec<f32>,
    /// Factor by which the exponent multiplies the squared distance from a centre.
    pub(crate) factor: f32,
}

impl Along {
    /// The cells along a side of length `side`, given as a multiple of the input's height. `deviation` is in cells.
    pub(crate) fn new(cells: usize, side: f32, deviation: f32) -> Self {
        let cell = side / cells as f32;
        let centre = |at: usize| (at as f32 + 0.5) * cell - 0.5 * side;
        Self {
            centres: (0..cells).map(centre).collect(),
            factor: -0.5 / (deviation * cell).powi(2),
        }
    }

    /// The weight of every cell for a given position.
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

/// Dimensions after concatenation.
pub(crate) fn joined(parts: &[&[usize]]) -> Dims {
    let mut dims = parts.first().map_or_else(Dims::new, |first| first.to_vec());
    if let Some(channels) = dims.first_mut() {
        *channels = parts.iter().map(|part| part[0]).sum();
    }
    dims
}
