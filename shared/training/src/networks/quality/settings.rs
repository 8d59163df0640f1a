//! Settings of the training of a network that predicts errors.

use serde::{Deserialize, Serialize};

use super::network::{Kind, Shape};
use crate::networks::settings::{SettingsError, check, count, from_zero};

/// Loss function for the difference between a predicted and a true error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Loss {
    /// Half the squared length of the vector of differences, as in the paper.
    L2,
    /// The Huber loss: the same as `L2` for differences up to 1, and linear above.
    Robust,
}

impl Loss {
    /// Returns the loss of one difference.
    pub(super) fn cost(self, off: f32) -> f32 {
        match self {
            Self::L2 => 0.5 * off * off,
            Self::Robust => {
                let capped = off.abs().min(1.0);
                capped * off.abs() - 0.5 * capped * capped
            }
        }
    }

    /// Returns the derivative of the loss with respect to the difference.
    pub(super) fn slope(self, off: f32) -> f32 {
        match self {
            Self::L2 => off,
            Self::Robust => off.clamp(-1.0, 1.0),
        }
    }
}

/// The unit of the network's output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// The error as a share of the height that the tile shows.
    Relative,
    /// The logarithm of the relative error, see [`viewquality::Unit::LogRelative`].
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

/// Settings of the training of a network; the defaults are those of the built-in network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Kind of the network.
    pub network: Kind,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Unit of the network's output.
    pub unit: Unit,
    /// Loss of the network's output.
    pub loss: Loss,
    /// Maximum number of passes over the samples.
    pub epochs: u32,
    /// Number of passes without improvement in validation after which the training ends.
    pub patience: u32,
    /// Number of samples per step.
    pub batch: usize,
    /// Initial learning rate; it decreases to 0 as a cosine.
    pub rate: f32,
    /// Share of the last step that is added to each step.
    pub momentum: f32,
    /// Weight decay.
    pub decay: f32,
    /// Largest length of the gradient: a longer gradient is scaled down to this length (gradient clipping).
    pub longest: f32,
    /// Share of the groups (subjects, images) used for validation.
    pub validation: f32,
    /// Number of channels of the small network's first layer.
    pub width: usize,
    /// Size of the hidden layer.
    pub hidden: usize,
    /// Share of the hidden layer's values that are dropped.
    pub dropout: f32,
    /// For VGG-16, number of passes in which only the new last layers are trained.
    pub frozen_epochs: u32,
    /// For VGG-16, number of blocks of convolutions that are trained after the frozen passes, counted from the last block.
    pub unfrozen_blocks: usize,
    /// Augmentation of the samples.
    pub vary: Vary,
}

/// Augmentation of the training samples; validation and test samples are not changed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Vary {
    /// Share of samples that are mirrored, with left and right swapped.
    pub mirror: f32,
    /// Largest shift of the tile, in heights of the tile.
    pub shift: f32,
    /// Largest enlargement or reduction of the tile, as a share.
    pub scale: f32,
    /// Share of samples that are blurred.
    pub blur: f32,
    /// Largest standard deviation of the blur, in pixels of the tile.
    pub blur_px: f32,
    /// Share of samples with added noise.
    pub noise: f32,
    /// Largest standard deviation of the noise, for colours from 0 to 1.
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

impl Settings {
    /// Checks that all settings are in range.
    ///
    /// # Errors
    ///
    /// Returns an error for the first setting that is out of range.
    pub fn check(&self) -> Result<(), SettingsError> {
        let vary = &self.vary;
        let numbers = [
            from_zero("rate", self.rate, 10.0),
            from_zero("momentum", self.momentum, 0.999),
            from_zero("decay", self.decay, 1.0),
            from_zero("longest", self.longest, 1e9),
            from_zero("validation", self.validation, 0.9),
            from_zero("dropout", self.dropout, 0.95),
            from_zero("vary.mirror", vary.mirror, 1.0),
            from_zero("vary.shift", vary.shift, 0.05),
            from_zero("vary.scale", vary.scale, 0.1),
            from_zero("vary.blur", vary.blur, 1.0),
            from_zero("vary.blur_px", vary.blur_px, 4.0),
            from_zero("vary.noise", vary.noise, 1.0),
            from_zero("vary.noise_level", vary.noise_level, 1.0),
        ];
        let counts = [
            count("epochs", self.epochs as usize, 100_000),
            count("batch", self.batch, 4096),
            count("width", self.width, 256),
            count("hidden", self.hidden, 8192),
        ];
        check(&numbers, &counts)
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
    fn the_defaults_are_valid_and_errors_name_invalid_settings() {
        assert_eq!(Settings::default().check(), Ok(()));
        let change: [(&str, Change); 5] = [
            ("batch", |settings| settings.batch = 0),
            ("dropout", |settings| settings.dropout = 1.0),
            ("rate", |settings| settings.rate = f32::NAN),
            ("vary.shift", |settings| settings.vary.shift = 0.5),
            ("validation", |settings| settings.validation = -0.1),
        ];
        for (name, change) in change {
            let mut settings = Settings::default();
            change(&mut settings);
            assert_eq!(settings.check().unwrap_err().setting, name);
        }
    }

    #[test]
    fn the_slope_of_a_loss_equals_finite_differences() {
        for loss in [Loss::L2, Loss::Robust] {
            for off in [-3.0, -0.7, 0.0, 0.2, 0.9, 1.1, 5.0] {
                let change = (loss.cost(off + 1e-2) - loss.cost(off - 1e-2)) / 2e-2;
                assert!((change - loss.slope(off)).abs() < 1e-3, "{loss:?} {off}");
            }
        }
    }
}
