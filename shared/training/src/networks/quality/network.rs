//! The networks that predict the errors of the parts in a single view.

use skeleton::N_PARTS;
use viewquality::{N_TYPES, PART_NUMBERS, n_evidence};

use crate::networks::ops::{Conv, Dims, Network, Ops, Output, Places, Scaling};

/// Name of the input that takes the tile, `[n, 3, height, width]`.
pub const TILE: &str = "tile";
/// Name of the input that takes the evidence, `[n, values]`.
pub const EVIDENCE: &str = "evidence";
/// Name of the output, `[n, parts]`.
pub const SIGMA: &str = "sigma";

/// The positions of the parts in [`viewquality::evidence()`], in tile heights from the centre of the tile.
///
/// * `tile`: height and width of the tile.
fn places([height, width]: [usize; 2]) -> Places {
    let columns =
        |name: &str| -> Vec<usize> { (0..N_PARTS).filter_map(|part| column(part, name)).collect() };
    Places {
        x: columns("x"),
        y: columns("y"),
        width: width as f32 / height as f32,
        deviation: LOOK,
    }
}

/// Number of values per part in the evidence.
pub(crate) const PER_PART: usize = PART_NUMBERS.len() + N_TYPES;

/// Column of one of the values of a part.
pub(crate) fn column(part: usize, name: &str) -> Option<usize> {
    let at = PART_NUMBERS.iter().position(|known| *known == name)?;
    Some(part * PER_PART + at)
}

/// Kinds of networks that predict errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A network that uses only the evidence and no pixels: the baseline.
    Evidence,
    /// A network that uses the evidence, and a few separable convolutions that are pooled around every part.
    Small,
    /// The paper's network: VGG-16 with different last layers. It uses only the tile.
    Vgg16,
}

impl Kind {
    /// All kinds of networks.
    pub const ALL: [Self; 3] = [Self::Evidence, Self::Small, Self::Vgg16];

    /// Name of the kind in settings and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Evidence => "evidence",
            Self::Small => "small",
            Self::Vgg16 => "vgg16",
        }
    }

    /// Height and width of the network's tile, in pixels; `None` if it uses no tile.
    pub fn tile(self) -> Option<[usize; 2]> {
        match self {
            Self::Evidence => None,
            Self::Small => Some([160, 64]),
            Self::Vgg16 => Some([160, 48]),
        }
    }

    /// Returns true if the network uses the evidence.
    pub fn sees_evidence(self) -> bool {
        self != Self::Vgg16
    }
}

/// The sizes of a network.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Kind of the network.
    pub kind: Kind,
    /// Number of channels of the small network's first layer; later layers have multiples of this number.
    pub width: usize,
    /// Size of the hidden dense layer.
    pub hidden: usize,
    /// Share of the values that are dropped during training.
    pub dropout: f32,
}

impl Network for Shape {
    fn inputs(&self) -> Vec<(&'static str, Dims)> {
        let mut all = Vec::new();
        if let Some([height, width]) = self.kind.tile() {
            all.push((TILE, vec![3, height, width]));
        }
        if self.kind.sees_evidence() {
            all.push((EVIDENCE, vec![n_evidence(N_PARTS)]));
        }
        all
    }

    fn outputs(&self) -> Vec<Output> {
        vec![Output {
            name: SIGMA,
            is_logarithm: false,
        }]
    }

    /// Runs the network: one value for every part.
    fn run<O: Ops>(&self, ops: &mut O) -> Vec<O::Value> {
        let last = match self.kind {
            Kind::Evidence => {
                let evidence = ops.input(EVIDENCE);
                ops.centred(&evidence, EVIDENCE)
            }
            Kind::Small => small(ops, self),
            Kind::Vgg16 => vgg16(ops),
        };
        vec![top(ops, &last, self)]
    }
}

/// Standard deviation of the pooling around a part, in cells of the map.
const LOOK: f32 = 0.7;

/// The shape of the small network's convolutions.
fn full(channels: usize, kernel: usize, stride: usize) -> Conv {
    Conv {
        channels,
        kernel,
        stride,
        by_channel: false,
        scaling: Scaling::Batch,
    }
}

fn small<O: Ops>(ops: &mut O, shape: &Shape) -> O::Value {
    let width = shape.width;
    let evidence = ops.input(EVIDENCE);
    let centred = ops.centred(&evidence, EVIDENCE);
    let tile = ops.input(TILE);
    let mut map = convolved(ops, &tile, "first", full(width, 3, 2));
    let mut channels = width;
    let mut joined = Vec::new();
    for (nth, (times, stride)) in [(2, 2), (4, 2), (4, 1), (8, 2)].into_iter().enumerate() {
        let depthwise = Conv {
            by_channel: true,
            ..full(channels, 3, stride)
        };
        map = convolved(ops, &map, &format!("depth{nth}"), depthwise);
        channels = times * width;
        map = convolved(ops, &map, &format!("point{nth}"), full(channels, 1, 1));
        if nth == 2 {
            let narrow = convolved(ops, &map, "narrow", full(2 * width, 1, 1));
            let size = shape.kind.tile().unwrap_or([1, 1]);
            let around = ops.around(&evidence, &narrow, &places(size));
            joined.push(ops.look(&narrow, &around));
        }
    }
    joined.push(ops.mean(&map));
    joined.push(centred);
    ops.join(&joined.iter().collect::<Vec<&O::Value>>())
}

/// A convolution and the positive part of its result.
fn convolved<O: Ops>(ops: &mut O, map: &O::Value, name: &str, conv: Conv) -> O::Value {
    let map = ops.conv(map, name, conv);
    ops.relu(&map)
}

/// Numbers of channels of the convolutions of VGG-16, between the poolings (Simonyan & Zisserman 2015, table 1, D).
pub const VGG16: [&[usize]; 5] = [
    &[64, 64],
    &[128, 128],
    &[256, 256, 256],
    &[512, 512, 512],
    &[512, 512, 512],
];

fn vgg16<O: Ops>(ops: &mut O) -> O::Value {
    let mut map = ops.input(TILE);
    for (block, layers) in VGG16.iter().enumerate() {
        for (nth, &channels) in layers.iter().enumerate() {
            let conv = Conv {
                scaling: Scaling::Plain,
                ..full(channels, 3, 1)
            };
            map = convolved(ops, &map, &format!("conv{}_{}", block + 1, nth + 1), conv);
        }
        map = ops.pool(&map);
    }
    ops.flat(&map)
}

/// The paper's top (section 4.3): dense layer, `PReLU`, dropout, and one value for every part.
fn top<O: Ops>(ops: &mut O, list: &O::Value, shape: &Shape) -> O::Value {
    let hidden = ops.dense(list, "hidden", shape.hidden);
    let hidden = ops.prelu(&hidden, "slope");
    let hidden = ops.dropout(&hidden, shape.dropout);
    ops.dense(&hidden, "parts", N_PARTS)
}
