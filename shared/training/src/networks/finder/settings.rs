//! Settings of the training of the network that finds people.

use serde::{Deserialize, Serialize};

use super::network::{MULTIPLE, Shape};
use crate::networks::settings::{Precision, SettingsError, check, count, from_zero};

/// Settings of a training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Random seed.
    pub seed: u64,
    /// The sizes of the network.
    pub shape: Shape,
    /// Numbers between layers.
    pub precision: Precision,
    /// Samples a step.
    pub batch: usize,
    /// Steps of the training.
    pub steps: usize,
    /// Share of the steps, the first ones, that are shown inputs of three quarters of the side.
    pub small: f32,
    /// Longest step: reached after a twentieth of the training, from where it falls as a cosine.
    pub rate: f32,
    /// Share of every weight that is taken away, times the rate.
    pub decay: f32,
    /// Gradient clipping: longer gradients are scaled to this length.
    pub longest: f32,
    /// Share of the mean of the parameters that every step replaces.
    pub averaged: f32,
    /// Weight of the sides of boxes beside the heat.
    pub sides: f32,
    /// How samples are varied.
    pub vary: Vary,
}

/// How samples are varied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Vary {
    /// Share of samples that show one picture; the others get people of further pictures pasted into it.
    pub single: f32,
    /// Most pictures that are pasted.
    pub most_pasted: usize,
    /// Height of a person, shares of the height of the picture that is shown, the least.
    pub least_height: f32,
    /// The most.
    pub most_height: f32,
    /// Share of samples of low resolution.
    pub coarse: f32,
    /// Share of samples without colour.
    pub grey: f32,
}

impl Default for Vary {
    fn default() -> Self {
        Self {
            single: 0.5,
            most_pasted: 4,
            least_height: 0.12,
            most_height: 1.1,
            coarse: 0.15,
            grey: 0.1,
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            seed: 1,
            shape: Shape::default(),
            precision: Precision::F32,
            batch: 16,
            steps: 8000,
            small: 0.5,
            rate: 2e-3,
            decay: 0.05,
            longest: 5.0,
            averaged: 0.003,
            sides: 1.0,
            vary: Vary::default(),
        }
    }
}

impl Settings {
    /// Checks every setting.
    ///
    /// # Errors
    ///
    /// The first that cannot be used.
    pub fn check(&self) -> Result<(), SettingsError> {
        let Shape {
            side,
            stem,
            channels,
            ..
        } = self.shape;
        if side == 0 || side % MULTIPLE != 0 || side > 1024 {
            return Err(SettingsError {
                setting: "shape.side",
                got: side.to_string(),
                expected: format!("a multiple of {MULTIPLE} up to 1024"),
            });
        }
        let counts = [
            count("shape.stem", stem, 4096),
            count("batch", self.batch, 4096),
            count("vary.most_pasted", self.vary.most_pasted, 64),
        ];
        let channels = channels.map(|n| count("shape.channels", n, 4096));
        let vary = &self.vary;
        let numbers = [
            from_zero("small", self.small, 1.0),
            from_zero("rate", self.rate, 1.0),
            from_zero("decay", self.decay, 1.0),
            from_zero("longest", self.longest, 1e6),
            from_zero("averaged", self.averaged, 1.0),
            from_zero("sides", self.sides, 1e3),
            from_zero("vary.single", vary.single, 1.0),
            from_zero("vary.least_height", vary.least_height, vary.most_height),
            from_zero("vary.most_height", vary.most_height, 10.0),
            from_zero("vary.coarse", vary.coarse, 1.0),
            from_zero("vary.grey", vary.grey, 1.0),
        ];
        check(&[], &channels)?;
        check(&numbers, &counts)
    }
}
