//! The description of a network in its file: the ONNX `metadata_props`.

use std::collections::BTreeMap;

use crate::{EVIDENCE_VERSION, Normalisation, TileShape};

/// Names of the entries in the file's metadata.
pub mod key {
    /// Version of these entries: `1`. All entries are optional; see [`Card`](super::Card).
    pub const VERSION: &str = "parallax.version";
    /// Height and width of the tile: `160x64`.
    pub const TILE: &str = "parallax.tile";
    /// Mean of red, green and blue, from 0 to 1, separated by white space or commas.
    pub const MEAN: &str = "parallax.mean";
    /// Standard deviation of red, green and blue, above 0.
    pub const STD: &str = "parallax.std";
    /// Version of the layout of the second input; absent if the network only takes the tile.
    pub const EVIDENCE: &str = "parallax.evidence";
    /// Unit of the output: `pixels`, `relative` or `log-relative`.
    pub const OUTPUT: &str = "parallax.output";
    /// Name of the network for users.
    pub const IDENTITY: &str = "parallax.identity";
    /// Thresholds for switching parts off, one per part; see [`Card::tau`](super::Card::tau).
    pub const TAU: &str = "parallax.tau";
}

/// The only version of the entries.
const VERSION: u32 = 1;
/// Fraction of the tile's height that is the unit of the logarithm.
const LOG_UNIT: f64 = 0.01;
/// Largest side of a tile, in pixels.
pub(crate) const MAX_SIDE: usize = 1024;

/// The unit of a network's output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Unit {
    /// Expected error `e`, in pixels of the original image.
    #[default]
    Pixels,
    /// `e / h`, where `h` is the height of the tile in pixels of the original image.
    Relative,
    /// `ln(1 + e / (0.01 h))`, with `e` and `h` as for [`Self::Relative`].
    LogRelative,
}

impl Unit {
    /// The name of the unit in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pixels => "pixels",
            Self::Relative => "relative",
            Self::LogRelative => "log-relative",
        }
    }

    fn by_name(name: &str) -> Option<Self> {
        let all = [Self::Pixels, Self::Relative, Self::LogRelative];
        all.into_iter().find(|unit| unit.name() == name)
    }

    /// The training label for an error.
    ///
    /// * `error`, `tile_height`: distance from the true position, and height that the tile shows, in the same unit.
    pub fn label(self, error: f64, tile_height: f64) -> f64 {
        match self {
            Self::Pixels => error,
            Self::Relative => error / tile_height,
            Self::LogRelative => (error / (LOG_UNIT * tile_height)).ln_1p(),
        }
    }

    /// The expected error for an output, in the unit of `tile_height`; the inverse of
    /// [`Self::label`]. Negative errors become 0.
    ///
    /// * Returns `None` if the error is not finite.
    pub fn error(self, output: f32, tile_height: f64) -> Option<f32> {
        let output = f64::from(output);
        let error = match self {
            Self::Pixels => output,
            Self::Relative => output * tile_height,
            Self::LogRelative => output.exp_m1() * LOG_UNIT * tile_height,
        };
        let error = error.max(0.0) as f32;
        (output.is_finite() && error.is_finite()).then_some(error)
    }
}

/// The description of a network that is stored in its file in addition to the graph.
#[derive(Debug, Clone, PartialEq)]
pub struct Card {
    /// Size of the tile; if `None`, the size of the network's input.
    pub tile: Option<TileShape>,
    /// The normalisation of colours; by default the one of networks trained on `ImageNet`.
    pub colours: Normalisation,
    /// The version of the [`evidence`](crate::evidence()) that the network takes; `None` if it takes no evidence.
    pub evidence: Option<u32>,
    /// The unit of the network's output; by default pixels.
    pub unit: Unit,
    /// Name of the network for users; may be empty.
    pub identity: String,
    /// Errors above which a part is switched off; empty by default. If the unit is pixels, they are pixels of the
    /// original image. Otherwise, they are fractions of the tile's height, never logarithms.
    pub tau: Vec<f32>,
}

impl Default for Card {
    fn default() -> Self {
        Self {
            tile: None,
            colours: Normalisation::IMAGENET,
            evidence: None,
            unit: Unit::Pixels,
            identity: String::new(),
            tau: Vec::new(),
        }
    }
}

/// Reason why an entry was rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CardError {
    /// An entry cannot be read.
    #[error("`{key}` is `{got}`, expected {expected}")]
    Entry {
        /// Name of the entry.
        key: &'static str,
        /// The first characters of the entry's value.
        got: String,
        /// The accepted values.
        expected: String,
    },
    /// The name of an entry is unknown: it is misspelt, or belongs to a later version.
    #[error("`{key}` is not an entry of version {VERSION}")]
    Unknown {
        /// The first characters of the name.
        key: String,
    },
}

impl Card {
    /// Reads entries. Entries whose names do not begin with `parallax.` are ignored.
    ///
    /// * `entries`: names and values of `metadata_props`; if a name occurs several times, the last one counts.
    /// * `n_parts`: number of parts of the model, used to check the number of thresholds.
    ///
    /// # Errors
    ///
    /// Fails with [`CardError`], naming the entry.
    pub fn parse<'a>(
        entries: impl IntoIterator<Item = (&'a str, &'a str)>,
        n_parts: usize,
    ) -> Result<Self, CardError> {
        let mut card = Self::default();
        for (name, value) in entries {
            if !name.starts_with("parallax.") {
                continue;
            }
            match name {
                key::VERSION => version(key::VERSION, value, VERSION).map(drop)?,
                key::TILE => card.tile = Some(tile(value)?),
                key::MEAN => card.colours.mean = colour(key::MEAN, value, |_| true)?,
                key::STD => card.colours.deviation = colour(key::STD, value, |value| value > 0.0)?,
                key::EVIDENCE => {
                    card.evidence = Some(version(key::EVIDENCE, value, EVIDENCE_VERSION)?);
                }
                key::OUTPUT => {
                    let expected = "`pixels`, `relative` or `log-relative`";
                    card.unit = Unit::by_name(value.trim())
                        .ok_or_else(|| entry(key::OUTPUT, value, expected))?;
                }
                key::IDENTITY => value.clone_into(&mut card.identity),
                key::TAU => card.tau = tau(value, n_parts)?,
                _ => {
                    let key = shortened(name);
                    return Err(CardError::Unknown { key });
                }
            }
        }
        Ok(card)
    }

    /// The entries for a file, from which [`Self::parse`] reads the same card.
    pub fn entries(&self) -> BTreeMap<&'static str, String> {
        let join = |values: &[f32]| {
            let words: Vec<String> = values.iter().map(f32::to_string).collect();
            words.join(" ")
        };
        let mut entries = BTreeMap::from([
            (key::VERSION, VERSION.to_string()),
            (key::MEAN, join(&self.colours.mean)),
            (key::STD, join(&self.colours.deviation)),
            (key::OUTPUT, self.unit.name().to_owned()),
        ]);
        if let Some(TileShape { height, width }) = self.tile {
            entries.insert(key::TILE, format!("{height}x{width}"));
        }
        if let Some(version) = self.evidence {
            entries.insert(key::EVIDENCE, version.to_string());
        }
        if !self.identity.is_empty() {
            entries.insert(key::IDENTITY, self.identity.clone());
        }
        if !self.tau.is_empty() {
            entries.insert(key::TAU, join(&self.tau));
        }
        entries
    }

    /// The thresholds in the unit of `tile_height`; empty if there are none.
    pub fn tau_px(&self, tile_height: f64) -> impl Iterator<Item = f32> + '_ {
        let scale = match self.unit {
            Unit::Pixels => 1.0,
            Unit::Relative | Unit::LogRelative => tile_height,
        };
        self.tau.iter().map(move |tau| (f64::from(*tau) * scale) as f32)
    }
}

fn entry(key: &'static str, got: &str, expected: impl Into<String>) -> CardError {
    let (got, expected) = (shortened(got), expected.into());
    CardError::Entry { key, got, expected }
}

fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

fn version(key: &'static str, value: &str, known: u32) -> Result<u32, CardError> {
    let number = value.trim().parse().ok();
    let known = number.filter(|number| *number == known).ok_or(known);
    known.map_err(|known| entry(key, value, known.to_string()))
}

fn tile(value: &str) -> Result<TileShape, CardError> {
    let side = |text: &str| {
        let side = text.trim().parse().ok()?;
        (1..=MAX_SIDE).contains(&side).then_some(side)
    };
    let sides = value.split_once('x');
    let sides = sides.and_then(|(height, width)| Some((side(height)?, side(width)?)));
    let expected = || format!("height x width, each 1 to {MAX_SIDE} pixels, as `160x64`");
    let (height, width) = sides.ok_or_else(|| entry(key::TILE, value, expected()))?;
    Ok(TileShape { height, width })
}

fn numbers(value: &str, is_fit: impl Fn(f32) -> bool) -> Option<Vec<f32>> {
    let words = value.split(|letter: char| letter == ',' || letter.is_whitespace());
    let words = words.filter(|word| !word.is_empty());
    let number = |word: &str| word.parse().ok().filter(|value| is_fit(*value));
    words.map(number).collect()
}

fn colour(
    key: &'static str,
    value: &str,
    is_fit: impl Fn(f32) -> bool,
) -> Result<[f32; 3], CardError> {
    let read = numbers(value, |value| value.is_finite() && is_fit(value));
    let read = read.and_then(|values| <[f32; 3]>::try_from(values).ok());
    let above = if key == key::STD { " above 0" } else { "" };
    read.ok_or_else(|| entry(key, value, format!("three numbers{above}")))
}

fn tau(value: &str, n_parts: usize) -> Result<Vec<f32>, CardError> {
    let read = numbers(value, |value| (0.0..=f32::MAX).contains(&value));
    let read = read.filter(|values| values.len() == n_parts);
    read.ok_or_else(|| {
        entry(
            key::TAU,
            value,
            format!("{n_parts} finite numbers of at least 0"),
        )
    })
}

#[cfg(test)]
mod tests;
