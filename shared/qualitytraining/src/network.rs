//! The networks, each defined once: planning parameters, running and writing ONNX are implementations of
//! [`Ops`].

use skeleton::N_PARTS;
use viewquality::{N_TYPES, PART_NUMBERS};

/// A convolution, followed by batch normalisation (where asked for) and `ReLU`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conv {
    /// Output channels.
    pub channels: usize,
    /// Side of the square kernel, odd; as much padding as keeps the size at stride 1.
    pub kernel: usize,
    /// Step between two outputs.
    pub stride: usize,
    /// Depthwise: one filter for every channel; `channels` is the number of input channels.
    pub by_channel: bool,
    /// Whether its outputs are normalised over the batch; it then has no bias of its own.
    pub normalised: bool,
}

/// The columns of the evidence with the positions of the parts: tile heights from its centre.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Places {
    /// Across the tile, one column a part.
    pub x: Vec<usize>,
    /// Down the tile.
    pub y: Vec<usize>,
}

impl Default for Places {
    /// Those of [`viewquality::evidence()`].
    fn default() -> Self {
        let columns = |name: &str| -> Vec<usize> {
            (0..N_PARTS).filter_map(|part| column(part, name)).collect()
        };
        Self {
            x: columns("x"),
            y: columns("y"),
        }
    }
}

/// Numbers per part in the evidence.
pub(crate) const PER_PART: usize = PART_NUMBERS.len() + N_TYPES;

/// Column of a number of a part.
pub(crate) fn column(part: usize, name: &str) -> Option<usize> {
    let at = PART_NUMBERS.iter().position(|it| *it == name)?;
    Some(part * PER_PART + at)
}

/// The operations that networks are made of.
///
/// The first dimension of a value is the batch: maps are `[n, channels, rows, cols]`, lists `[n, values]`.
/// Parameters are used in the order of the calls, which is the same for every implementation.
pub trait Ops {
    /// A map or a list.
    type Value: Clone;

    /// The tile: a map of 3 channels.
    fn tile(&mut self) -> Self::Value;
    /// The evidence, every column with mean 0 and deviation 1 over the training samples: a list.
    fn evidence(&mut self) -> Self::Value;
    /// Convolves a map.
    fn conv(&mut self, of: &Self::Value, name: &str, conv: Conv) -> Self::Value;
    /// The largest of every 2 x 2 of a map.
    fn pool(&mut self, of: &Self::Value) -> Self::Value;
    /// The mean of every channel of a map: a list.
    fn mean(&mut self, of: &Self::Value) -> Self::Value;
    /// A map as a list.
    fn flat(&mut self, of: &Self::Value) -> Self::Value;
    /// Pools a map around every part: a list of the channels of the first part, of the second, and so on.
    ///
    /// The mean of the map weighted by a Gaussian of the given deviation (cells of the map) about the part.
    fn look(&mut self, of: &Self::Value, places: &Places, deviation: f32) -> Self::Value;
    /// Concatenates lists.
    fn join(&mut self, of: &[&Self::Value]) -> Self::Value;
    /// A dense layer with bias.
    fn dense(&mut self, of: &Self::Value, name: &str, values: usize) -> Self::Value;
    /// `ReLU` with a learnt slope for negative values, one a value of the list.
    fn prelu(&mut self, of: &Self::Value, name: &str) -> Self::Value;
    /// While training, sets this share of the values to 0 and enlarges the others.
    fn dropout(&mut self, of: &Self::Value, share: f32) -> Self::Value;
}

/// Which network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// The evidence alone, without pixels: the baseline.
    Evidence,
    /// A few separable convolutions, pooled around every part, and the evidence.
    Small,
    /// The paper's: VGG-16 with another top, on the tile alone.
    Vgg16,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Evidence, Self::Small, Self::Vgg16];

    /// Its name in settings and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Evidence => "evidence",
            Self::Small => "small",
            Self::Vgg16 => "vgg16",
        }
    }

    /// Height and width of its tile, pixels; `None` if it uses none.
    pub fn tile(self) -> Option<[usize; 2]> {
        match self {
            Self::Evidence => None,
            Self::Small => Some([160, 64]),
            Self::Vgg16 => Some([160, 48]),
        }
    }

    /// Whether it uses the evidence.
    pub fn sees_evidence(self) -> bool {
        self != Self::Vgg16
    }
}

/// The sizes of a network.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Which one.
    pub kind: Kind,
    /// Channels of the small network's first layer; the later ones have multiples of it.
    pub width: usize,
    /// Values of the hidden dense layer.
    pub hidden: usize,
    /// Share of the values that are dropped while training.
    pub dropout: f32,
}

/// Runs a network: one value for every part, as a list.
pub fn run<O: Ops>(ops: &mut O, shape: &Shape) -> O::Value {
    match shape.kind {
        Kind::Evidence => {
            let evidence = ops.evidence();
            top(ops, &evidence, shape)
        }
        Kind::Small => small(ops, shape),
        Kind::Vgg16 => vgg16(ops, shape),
    }
}

/// Standard deviation of the pooling around a part, cells of the map.
const LOOK: f32 = 0.7;

fn small<O: Ops>(ops: &mut O, shape: &Shape) -> O::Value {
    let width = shape.width;
    let evidence = ops.evidence();
    let tile = ops.tile();
    let full = |channels: usize, kernel: usize, stride: usize| Conv {
        channels,
        kernel,
        stride,
        by_channel: false,
        normalised: true,
    };
    let mut map = ops.conv(&tile, "first", full(width, 3, 2));
    let mut channels = width;
    let mut looked = None;
    for (nth, (times, stride)) in [(2, 2), (4, 2), (4, 1), (8, 2)].into_iter().enumerate() {
        let depthwise = Conv {
            by_channel: true,
            ..full(channels, 3, stride)
        };
        map = ops.conv(&map, &format!("depth{nth}"), depthwise);
        channels = times * width;
        map = ops.conv(&map, &format!("point{nth}"), full(channels, 1, 1));
        if nth == 2 {
            let narrow = ops.conv(&map, "narrow", full(2 * width, 1, 1));
            looked = Some(ops.look(&narrow, &Places::default(), LOOK));
        }
    }
    let whole = ops.mean(&map);
    let joined = match looked {
        Some(looked) => ops.join(&[&looked, &whole, &evidence]),
        None => ops.join(&[&whole, &evidence]),
    };
    top(ops, &joined, shape)
}

/// Channels of the convolutions of VGG-16, between the poolings (Simonyan & Zisserman 2015, table 1, D).
pub const VGG16: [&[usize]; 5] = [
    &[64, 64],
    &[128, 128],
    &[256, 256, 256],
    &[512, 512, 512],
    &[512, 512, 512],
];

fn vgg16<O: Ops>(ops: &mut O, shape: &Shape) -> O::Value {
    let mut map = ops.tile();
    for (block, layers) in VGG16.iter().enumerate() {
        for (nth, &channels) in layers.iter().enumerate() {
            let conv = Conv {
                channels,
                kernel: 3,
                stride: 1,
                by_channel: false,
                normalised: false,
            };
            map = ops.conv(&map, &format!("conv{}_{}", block + 1, nth + 1), conv);
        }
        map = ops.pool(&map);
    }
    let flat = ops.flat(&map);
    top(ops, &flat, shape)
}

/// The paper's top (section 4.3): dense, `PReLU`, dropout, one value for every part.
fn top<O: Ops>(ops: &mut O, of: &O::Value, shape: &Shape) -> O::Value {
    let hidden = ops.dense(of, "hidden", shape.hidden);
    let hidden = ops.prelu(&hidden, "slope");
    let hidden = ops.dropout(&hidden, shape.dropout);
    ops.dense(&hidden, "parts", N_PARTS)
}
