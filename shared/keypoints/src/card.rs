//! Inputs and outputs of a network, as described by a TOML file.

use serde::{Deserialize, Serialize};

use crate::names::SETS;

mod kind;
mod value;

pub use kind::CardKind;
pub(crate) use kind::{DETECTOR_FORMAT, FORMAT, VERSION, check_head};
pub use value::{Refine, Score};

/// Maximum side of an input, in pixels.
const MAX_SIDE: usize = 2048;
/// Maximum number of keypoints.
const MAX_KEYPOINTS: usize = 256;

/// The card of a network that finds keypoints.
///
/// Every key is checked, and unknown keys are rejected.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Card {
    /// Name of the format: `parallax-keypoint-network`.
    pub format: String,
    /// Version of the format: 1.
    pub version: u32,
    /// Name of the network.
    pub name: String,
    /// Source of the weights.
    #[serde(default)]
    pub weights: String,
    /// Licence of the weights.
    #[serde(default)]
    pub licence: String,
    /// Input of the network.
    pub input: Input,
    /// How the box around a person becomes the network's input.
    #[serde(default)]
    pub crop: Crop,
    /// Output of the network.
    pub output: Codec,
    /// Keypoints of the network.
    pub keypoints: KeypointNames,
    /// Outputs of the network in addition to the keypoints.
    #[serde(default, skip_serializing_if = "Also::is_empty")]
    pub also: Also,
}

/// Outputs of a network in addition to its keypoints.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Also {
    /// Output with the direction in which the trunk faces, `[1, 2]`: towards the right of the picture, towards the camera. For a direction
    /// of length 1, twice the scalar product with this output is the log-likelihood ratio of facing in that direction over facing away from
    /// it.
    pub front: Option<String>,
    /// Output with the expected error of every keypoint, `[1, keypoints]`, as a fraction of the height of the input.
    pub error: Option<String>,
}

impl Also {
    fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// Input of a network: one picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Name of the input; may be left out if there is only one input.
    pub name: Option<String>,
    /// Width, in pixels.
    pub width: usize,
    /// Height, in pixels.
    pub height: usize,
    /// Order of the input's axes.
    #[serde(default)]
    pub layout: Layout,
    /// Order of the colours.
    #[serde(default)]
    pub colour: Colour,
    /// Type of the input's numbers.
    #[serde(default)]
    pub numbers: Numbers,
    /// Factor by which a colour from 0 to 255 is multiplied first.
    #[serde(default = "one")]
    pub scale: f32,
    /// Numbers that are subtracted after that, one for each colour in the network's order.
    #[serde(default)]
    pub mean: [f32; 3],
    /// Numbers by which the result is divided at the end.
    #[serde(default = "ones")]
    pub std: [f32; 3],
}

/// Order of the axes of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// One plane for each colour: `[1, 3, height, width]`.
    #[default]
    Planes,
    /// Interleaved channels: `[1, height, width, 3]`.
    Pixels,
}

/// Order of the colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Colour {
    /// Red first.
    #[default]
    Rgb,
    /// Blue first.
    Bgr,
}

/// Type of the numbers in a network's input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Numbers {
    /// Single precision.
    #[default]
    F32,
    /// Bytes.
    U8,
    /// Whole numbers of 32 bits.
    I32,
}

/// How the box around a person becomes the network's input.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Crop {
    /// Factor by which the box is enlarged about its middle.
    pub margin: f64,
    /// How the box is given the aspect ratio of the input.
    pub fit: Fit,
    /// Colour outside the picture, 0 to 255.
    pub fill: u8,
}

impl Default for Crop {
    fn default() -> Self {
        Self {
            margin: 1.25,
            fit: Fit::default(),
            fill: 0,
        }
    }
}

/// How a box is given the aspect ratio of the input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fit {
    /// Widen the shorter side of the box.
    #[default]
    Widen,
    /// Stretch the box.
    Stretch,
}

/// Output of a network, and how it is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "codec", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Codec {
    /// A map for every keypoint.
    HeatMap {
        /// Name of the output; may be left out if there is only one output.
        maps: Option<String>,
        /// Order of the output's axes: `[1, keypoints, rows, columns]`, or keypoints last.
        #[serde(default)]
        layout: Layout,
        /// Number of further maps after those of the keypoints, such as the background or fields between joints; they are not read.
        #[serde(default)]
        further: usize,
        /// True if the corner cells of a map are at the corner pixels of the input, and the corner pixels are at the corners of the box
        /// (UDP: Huang et al. 2020; see [`Window`](crate::Window)). Otherwise, each cell covers a whole number of pixels, starting from the
        /// corner of the input.
        #[serde(default)]
        udp: bool,
        /// True if the position of each cell is the middle of the pixels that it covers; otherwise, it is the first of these pixels. Not
        /// allowed with `udp`.
        #[serde(default)]
        centred: bool,
        /// How the position of a maximum is refined.
        #[serde(default)]
        refine: Refine,
        /// Meaning of a score.
        #[serde(default)]
        score: Score,
    },
    /// For every keypoint, a distribution over columns and a distribution over rows.
    Simcc {
        /// Name of the output of columns.
        x: String,
        /// Name of the output of rows.
        y: String,
        /// Number of bins per pixel of the input.
        bins_per_pixel: f64,
        /// Natural log-likelihood that corresponds to one unit of the output. It makes scores of different networks comparable.
        #[serde(default = "ten")]
        nats: f64,
    },
    /// Positions and scores.
    Keypoints {
        /// Name of the output; may be left out if there is only one output.
        list: Option<String>,
        /// Meaning of the numbers of a keypoint, in order.
        fields: Vec<ListField>,
        /// Unit of positions.
        #[serde(default)]
        unit: ListUnit,
        /// Meaning of a score.
        #[serde(default)]
        score: Score,
    },
}

/// Meaning of one number of a listed keypoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ListField {
    /// Column of the keypoint.
    X,
    /// Row of the keypoint.
    Y,
    /// Score of the keypoint.
    Score,
    /// A number that is not read.
    Skip,
}

/// Unit of listed positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ListUnit {
    /// Pixels of the input.
    #[default]
    Pixel,
    /// Fractions of the input's width and height.
    Share,
}

/// Names of a network's keypoints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeypointNames {
    /// Name of a known set: [`SETS`](crate::SETS).
    pub set: Option<String>,
    /// Names of the keypoints in the order of the output, instead of a set.
    pub names: Option<Vec<String>>,
    /// Meaning of left and right.
    #[serde(default)]
    pub sides: Sides,
}

/// Meaning of left and right in the names of keypoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sides {
    /// Left and right are the person's own sides.
    #[default]
    Anatomical,
    /// Left and right are as they appear in the picture, so they are swapped for people who are seen from behind.
    Seen,
}

fn one() -> f32 {
    1.0
}

fn ones() -> [f32; 3] {
    [1.0; 3]
}

fn ten() -> f64 {
    10.0
}

/// Reason why a text was rejected as a card.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CardError {
    /// The text is not TOML with the expected keys.
    #[error(transparent)]
    Toml(#[from] toml::de::Error),
    /// The text has another format, or another version of it.
    #[error("`{format}` version {version}, expected `{expected}` version {VERSION}")]
    Version {
        /// Expected name of the format.
        expected: &'static str,
        /// Name of the format in the text.
        format: String,
        /// Version in the text.
        version: u32,
    },
    /// A value is out of range.
    #[error("`{key}` is {got}, expected {expected}")]
    Value {
        /// Key with its section.
        key: &'static str,
        /// Value of the key.
        got: String,
        /// Description of the values that are accepted.
        expected: String,
    },
}

impl Input {
    /// Converts a colour of a picture (red first, 0 to 255) to the values and the colour order of the network's input.
    pub fn prepared(&self, colour: [f32; 3]) -> [f32; 3] {
        core::array::from_fn(|channel| {
            let source = match self.colour {
                Colour::Rgb => channel,
                Colour::Bgr => 2 - channel,
            };
            (colour[source] * self.scale - self.mean[channel]) / self.std[channel]
        })
    }
}

impl Card {
    /// Parses a card.
    ///
    /// # Errors
    ///
    /// Returns a [`CardError`], which names the key.
    pub fn parse(text: &str) -> Result<Self, CardError> {
        check_head(text, FORMAT)?;
        let card: Self = toml::from_str(text)?;
        card.check()?;
        Ok(card)
    }

    /// Returns the names of the network's keypoints, in the order of the output.
    pub fn names(&self) -> Vec<String> {
        let of_set = |set: &String| {
            let known = SETS.iter().find(|known| known.0 == set)?;
            Some(known.1.iter().map(|&name| name.to_owned()).collect())
        };
        let named = self.keypoints.names.clone();
        named
            .or_else(|| self.keypoints.set.as_ref().and_then(of_set))
            .unwrap_or_default()
    }

    fn check(&self) -> Result<(), CardError> {
        check_input(&self.input)?;
        let margin = self.crop.margin;
        demand(
            (0.5..=4.0).contains(&margin),
            "crop.margin",
            &margin,
            || "0.5 to 4".to_owned(),
        )?;
        self.check_output()?;
        self.check_names()
    }

    fn check_output(&self) -> Result<(), CardError> {
        match &self.output {
            Codec::HeatMap {
                further,
                udp,
                centred,
                ..
            } => {
                demand(*further <= MAX_KEYPOINTS, "output.further", further, || {
                    format!("0 to {MAX_KEYPOINTS}")
                })?;
                demand(!(*udp && *centred), "output.centred", centred, || {
                    "false, because with `udp`, the centres of corner cells are the corner pixels"
                        .to_owned()
                })
            }
            Codec::Simcc {
                bins_per_pixel,
                nats,
                ..
            } => {
                let fits = (0.25..=16.0).contains(bins_per_pixel);
                demand(fits, "output.bins_per_pixel", bins_per_pixel, || {
                    "0.25 to 16".to_owned()
                })?;
                let fits = (0.01..=1000.0).contains(nats);
                demand(fits, "output.nats", nats, || "0.01 to 1000".to_owned())
            }
            Codec::Keypoints { fields, .. } => {
                let count =
                    |wanted: ListField| fields.iter().filter(|field| **field == wanted).count();
                let fits = count(ListField::X) == 1
                    && count(ListField::Y) == 1
                    && count(ListField::Score) <= 1
                    && fields.len() <= 16;
                demand(fits, "output.fields", &format!("{fields:?}"), || {
                    "\"x\" and \"y\" exactly once, \"score\" at most once, and \"skip\" for all other fields".to_owned()
                })
            }
        }
    }

    fn check_names(&self) -> Result<(), CardError> {
        let KeypointNames { set, names, .. } = &self.keypoints;
        if set.is_some() == names.is_some() {
            let got = if set.is_some() { "both" } else { "neither" };
            return demand(false, "keypoints", &got, || {
                "either `set` or `names`".to_owned()
            });
        }
        if let Some(set) = set {
            let known = SETS.map(|set| set.0);
            let is_known = known.contains(&set.as_str());
            return demand(is_known, "keypoints.set", &format!("{set:?}"), || {
                format!("one of {}", known.join(", "))
            });
        }
        let names = self.names();
        let n = names.len();
        demand(
            (1..=MAX_KEYPOINTS).contains(&n),
            "keypoints.names",
            &n,
            || format!("1 to {MAX_KEYPOINTS} names"),
        )?;
        let twice = names.iter().enumerate().find(|(nth, it)| names[..*nth].contains(it));
        demand(
            twice.is_none(),
            "keypoints.names",
            &twice.map_or("", |twice| twice.1),
            || "each name at most once".to_owned(),
        )
    }
}

/// Checks the input against the limits that apply to any network.
pub(crate) fn check_input(input: &Input) -> Result<(), CardError> {
    for (key, side) in [("input.width", input.width), ("input.height", input.height)] {
        let fits = (8..=MAX_SIDE).contains(&side);
        demand(fits, key, &side, || format!("8 to {MAX_SIDE} pixels"))?;
    }
    let Input {
        scale, mean, std, ..
    } = input;
    demand(
        *scale > 0.0 && scale.is_finite(),
        "input.scale",
        scale,
        || "more than 0".to_owned(),
    )?;
    let is_finite = mean.iter().all(|value| value.is_finite());
    demand(is_finite, "input.mean", &format!("{mean:?}"), || {
        "three finite numbers".to_owned()
    })?;
    let divides = std.iter().all(|value| value.is_finite() && *value > 0.0);
    demand(divides, "input.std", &format!("{std:?}"), || {
        "three numbers above 0".to_owned()
    })
}

pub(crate) fn demand(
    holds: bool,
    key: &'static str,
    got: &dyn core::fmt::Display,
    expected: impl FnOnce() -> String,
) -> Result<(), CardError> {
    if holds {
        return Ok(());
    }
    Err(CardError::Value {
        key,
        got: got.to_string(),
        expected: expected(),
    })
}

#[cfg(test)]
pub(crate) mod tests;
