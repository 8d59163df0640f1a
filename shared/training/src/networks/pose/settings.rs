//! Settings of the training of the network that finds joints.

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
    /// Share of the steps, counted from the first, with inputs that are 32 pixels smaller across and down: three fifths of the pixels by
    /// default.
    pub small: f32,
    /// Number of steps, after all other steps, that train only the expected error, on held-out people.
    pub error_steps: usize,
    /// Length of the longest step. It is reached after a tenth of the training, and then decreases as a cosine.
    pub rate: f32,
    /// Weight decay: the share of every weight that a step subtracts, before multiplication by the rate.
    pub decay: f32,
    /// Largest length of the gradient: a longer gradient is scaled down to this length (gradient clipping).
    pub longest: f32,
    /// Share of the running mean of the parameters that is replaced in every step.
    pub averaged: f32,
    /// Weight of the direction relative to the maps.
    pub front: f32,
    /// Weight of the expected error relative to the maps.
    pub error: f32,
    /// Random variation of the samples.
    pub vary: Vary,
}

/// Random variation of the samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Vary {
    /// Share of the samples that are rotated until the trunk is upright, before a random rotation.
    pub upright: f32,
    /// Standard deviation of the random rotation of samples with an upright trunk, in degrees.
    pub turn_upright: f32,
    /// Standard deviation of the random rotation of all other samples, in degrees.
    pub turn: f32,
    /// Standard deviation of the logarithm of the scale.
    pub scale: f32,
    /// Standard deviation of the shift of the window, in heights of the window.
    pub shift: f32,
    /// Share of samples with a window beside the person, in which no joint is to be found.
    pub empty: f32,
    /// Share of samples to which a second person is added.
    pub beside: f32,
    /// Share of samples that are partly covered.
    pub covered: f32,
    /// Share of samples whose resolution is reduced.
    pub coarse: f32,
    /// Share of samples that are converted to grey.
    pub grey: f32,
}

impl Default for Vary {
    fn default() -> Self {
        Self {
            upright: 0.5,
            turn_upright: 25.0,
            turn: 20.0,
            scale: 0.16,
            shift: 0.05,
            empty: 0.08,
            beside: 0.3,
            covered: 0.35,
            coarse: 0.25,
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
            batch: 32,
            steps: 26_000,
            small: 0.55,
            error_steps: 200,
            rate: 2e-3,
            decay: 0.05,
            longest: 1.0,
            averaged: 0.002,
            front: 0.3,
            error: 0.1,
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
        let shape = &self.shape;
        for (setting, side) in [("shape.width", shape.width), ("shape.height", shape.height)] {
            if side == 0 || side % MULTIPLE != 0 || side > 1024 {
                let expected = format!("a multiple of {MULTIPLE} up to 1024");
                return Err(SettingsError {
                    setting,
                    got: side.to_string(),
                    expected,
                });
            }
        }
        let counts = [
            count("shape.stem", shape.stem, 4096),
            count("shape.hidden", shape.hidden, 4096),
            count("batch", self.batch, 4096),
        ];
        let channels = shape.channels.map(|n| count("shape.channels", n, 4096));
        let vary = &self.vary;
        let numbers = [
            from_zero("small", self.small, 1.0),
            from_zero("rate", self.rate, 1.0),
            from_zero("decay", self.decay, 1.0),
            from_zero("longest", self.longest, 1e6),
            from_zero("averaged", self.averaged, 1.0),
            from_zero("front", self.front, 1e3),
            from_zero("error", self.error, 1e3),
            from_zero("vary.upright", vary.upright, 1.0),
            from_zero("vary.turn_upright", vary.turn_upright, 360.0),
            from_zero("vary.turn", vary.turn, 360.0),
            from_zero("vary.scale", vary.scale, 1.0),
            from_zero("vary.shift", vary.shift, 1.0),
            from_zero("vary.empty", vary.empty, 1.0),
            from_zero("vary.beside", vary.beside, 1.0),
            from_zero("vary.covered", vary.covered, 1.0),
            from_zero("vary.coarse", vary.coarse, 1.0),
            from_zero("vary.grey", vary.grey, 1.0),
        ];
        check(&[], &channels)?;
        check(&numbers, &counts)
    }
}
