//! Settings of the training of the network that finds people.

use serde::{Deserialize, Serialize};

use super::network::{MULTIPLE, Shape};
use crate::networks::settings::{Precision, SettingsError, check, count, from_zero};

/// Settings of a training run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Seed of all random numbers.
    pub seed: u64,
    /// The sizes of the network.
    pub shape: Shape,
    /// Precision of the maps between layers.
    pub precision: Precision,
    /// Number of samples per step.
    pub batch: usize,
    /// Number of steps of the training.
    pub steps: usize,
    /// Share of the steps, counted from the first, with inputs of three quarters of the full side.
    pub small: f32,
    /// Length of the longest step. It is reached after a twentieth of the training, and then decreases as a cosine.
    pub rate: f32,
    /// Weight decay: the share of every weight that a step subtracts, before multiplication by the rate.
    pub decay: f32,
    /// Largest length of the gradient: a longer gradient is scaled down to this length (gradient clipping).
    pub longest: f32,
    /// Share of the running mean of the parameters that is replaced in every step.
    pub averaged: f32,
    /// Weight of the cost of the boxes, relative to the cost of the heat.
    pub sides: f32,
    /// Random variation of the samples.
    pub vary: Vary,
}

/// Random variation of the samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Vary {
    /// Share of samples made from a single picture. In all other samples, people from other pictures are pasted in.
    pub single: f32,
    /// Maximum number of pasted pictures.
    pub most_pasted: usize,
    /// Minimum height of a person, as a share of the height of the shown picture.
    pub least_height: f32,
    /// Largest height of a person, as a share of the height of the shown picture.
    pub most_height: f32,
    /// Share of samples whose resolution is reduced.
    pub coarse: f32,
    /// Share of samples that are converted to grey.
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
    /// Returns an error for the first invalid setting.
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
