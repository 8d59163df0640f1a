//! How a network is trained.

use serde::{Deserialize, Serialize};

use crate::network::{Kind, Shape};

/// The loss of the difference between prediction and truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Loss {
    /// Half the squared length of the vector of differences, as in the paper.
    L2,
    /// The same for small differences, growing linearly for those of more than 1 (Huber).
    Robust,
}

impl Loss {
    /// Of one difference.
    pub fn of(self, off: f32) -> f32 {
        let size = off.abs();
        match self {
            Self::L2 => 0.5 * size * size,
            Self::Robust => {
                let capped = size.min(1.0);
                capped * size - 0.5 * capped * capped
            }
        }
    }
}

/// The unit of the network's output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// The error as a share of the height that the tile shows.
    Relative,
    /// The logarithm of it, see [`viewquality::Unit::LogRelative`].
    LogRelative,
}

impl From<Unit> for viewquality::Unit {
    fn from(unit: Unit) -> Self {
        match unit {
            Unit::Relative => Self::Relative,
            Unit::LogRelative => Self::LogRelative,
        }
    }
}

/// How a network is trained; the defaults are those of the network that ships.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Which network.
    pub network: Kind,
    /// Seed of everything random.
    pub seed: u64,
    /// Unit of the output.
    pub unit: Unit,
    /// Loss.
    pub loss: Loss,
    /// Most passes over the samples.
    pub epochs: u32,
    /// Passes without improvement of the validation after which it ends.
    pub patience: u32,
    /// Samples of one step.
    pub batch: usize,
    /// Initial learning rate; decreases to 0 as a cosine.
    pub rate: f32,
    /// Share of the last step that is made again.
    pub momentum: f32,
    /// Weight decay.
    pub decay: f32,
    /// Gradients longer than this are shortened to it.
    pub longest: f32,
    /// Share of the groups (subjects, images) for validation.
    pub validation: f32,
    /// Channels of the small network's first layer.
    pub width: usize,
    /// Values of the hidden layer.
    pub hidden: usize,
    /// Share of them that is dropped.
    pub dropout: f32,
    /// VGG-16: passes in which only the top is trained.
    pub frozen_epochs: u32,
    /// VGG-16: blocks of convolutions, counted from the last, that are trained after these.
    pub unfrozen_blocks: usize,
    /// Augmentation of the samples.
    pub vary: Vary,
}

/// Augmentation of the training samples; validation and test samples are not changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Vary {
    /// Share that is mirrored, left and right exchanged.
    pub mirror: f32,
    /// Most that the tile is moved, heights of the tile.
    pub shift: f32,
    /// Most that the tile is enlarged or reduced, as a share.
    pub scale: f32,
    /// Share that is blurred.
    pub blur: f32,
    /// Largest deviation of the blur, pixels of the tile.
    pub blur_px: f32,
    /// Share that gets noise.
    pub noise: f32,
    /// Largest deviation of the noise, of colours from 0 to 1.
    pub noise_level: f32,
}

impl Default for Vary {
    fn default() -> Self {
        Self {
            mirror: 0.5,
            shift: 0.03,
            scale: 0.08,
            blur: 0.3,
            blur_px: 1.2,
            noise: 0.3,
            noise_level: 0.05,
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            network: Kind::Small,
            seed: 1,
            unit: Unit::LogRelative,
            loss: Loss::Robust,
            epochs: 25,
            patience: 25,
            batch: 16,
            rate: 0.007,
            momentum: 0.9,
            decay: 0.002,
            longest: 20.0,
            validation: 0.15,
            width: 16,
            hidden: 256,
            dropout: 0.5,
            frozen_epochs: 5,
            unfrozen_blocks: 1,
            vary: Vary::default(),
        }
    }
}

/// A setting out of range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{what} is {got}, expected {expected}")]
pub struct SettingError {
    /// Which.
    pub what: &'static str,
    /// What it is.
    pub got: String,
    /// What it may be.
    pub expected: &'static str,
}

impl Settings {
    /// Checks that all settings are in range.
    ///
    /// # Errors
    ///
    /// [`SettingError`], the first.
    pub fn check(&self) -> Result<(), SettingError> {
        let vary = &self.vary;
        let shares = [
            ("momentum", self.momentum, 0.999),
            ("decay", self.decay, 1.0),
            ("validation", self.validation, 0.9),
            ("dropout", self.dropout, 0.95),
            ("vary.mirror", vary.mirror, 1.0),
            ("vary.blur", vary.blur, 1.0),
            ("vary.noise", vary.noise, 1.0),
            ("vary.noise_level", vary.noise_level, 1.0),
        ];
        let limited = [
            ("rate", self.rate, 10.0, "from 0 to 10"),
            ("longest", self.longest, 1e9, "a positive number"),
            ("vary.shift", vary.shift, 0.05, "from 0 to 0.05"),
            ("vary.scale", vary.scale, 0.1, "from 0 to 0.1"),
            ("vary.blur_px", vary.blur_px, 4.0, "from 0 to 4"),
        ];
        let shares = shares.map(|(what, got, most)| (what, got, most, "a share from 0, below 1"));
        for (what, got, most, expected) in shares.into_iter().chain(limited) {
            if !(0.0..=most).contains(&got) {
                let got = got.to_string();
                return Err(SettingError {
                    what,
                    got,
                    expected,
                });
            }
        }
        let counts = [
            ("epochs", self.epochs as usize, 100_000),
            ("batch", self.batch, 4096),
            ("width", self.width, 256),
            ("hidden", self.hidden, 8192),
        ];
        for (what, got, most) in counts {
            if !(1..=most).contains(&got) {
                return Err(SettingError {
                    what,
                    got: got.to_string(),
                    expected: "at least 1, and not beyond all measure",
                });
            }
        }
        Ok(())
    }

    /// The sizes of the network.
    pub fn shape(&self) -> Shape {
        Shape {
            kind: self.network,
            width: self.width,
            hidden: self.hidden,
            dropout: self.dropout,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Change = fn(&mut Settings);

    #[test]
    fn the_defaults_are_valid_and_invalid_settings_are_named() {
        assert_eq!(Settings::default().check(), Ok(()));
        let change: [(&str, Change); 5] = [
            ("batch", |it| it.batch = 0),
            ("dropout", |it| it.dropout = 1.0),
            ("rate", |it| it.rate = f32::NAN),
            ("vary.shift", |it| it.vary.shift = 0.5),
            ("validation", |it| it.validation = -0.1),
        ];
        for (name, change) in change {
            let mut settings = Settings::default();
            change(&mut settings);
            assert_eq!(settings.check().unwrap_err().what, name);
        }
    }
}
