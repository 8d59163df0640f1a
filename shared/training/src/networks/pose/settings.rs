//! Settings of the training of the network that finds joints.

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
    /// Share of the steps, the first ones, that are shown inputs of 32 pixels less across and down: three fifths of the pixels by
    /// default.
    pub small: f32,
    /// Steps after them that learn the expected error alone, on people who are kept apart.
    pub error_steps: usize,
    /// Longest step: reached after a tenth of the training, from where it falls as a cosine.
    pub rate: f32,
    /// Share of every weight that is taken away, times the rate.
    pub decay: f32,
    /// Gradient clipping: longer gradients are scaled to this length.
    pub longest: f32,
    /// Share of the mean of the parameters that every step replaces.
    pub averaged: f32,
    /// Learn the extra keypoints alone: everything else stays in the file as it is in the network that the training goes on from.
    pub extras_alone: bool,
    /// Weight of the direction beside the maps.
    pub front: f32,
    /// Weight of the expected error beside the maps.
    pub error: f32,
    /// How samples are varied.
    pub vary: Vary,
}

/// How samples are varied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Vary {
    /// Share of the samples that are turned until the trunk is upright, before they are turned at random.
    pub upright: f32,
    /// Deviation of the angle of those, degrees.
    pub turn_upright: f32,
    /// Deviation of the angle of the others.
    pub turn: f32,
    /// Deviation of the logarithm of the scale.
    pub scale: f32,
    /// Deviation of the place, window heights.
    pub shift: f32,
    /// Share of samples of which a part is covered.
    pub covered: f32,
    /// Share of samples of low resolution.
    pub coarse: f32,
    /// Share of samples without colour.
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
            extras_alone: false,
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
    /// The first that cannot be used.
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
            from_zero("vary.covered", vary.covered, 1.0),
            from_zero("vary.coarse", vary.coarse, 1.0),
            from_zero("vary.grey", vary.grey, 1.0),
        ];
        check(&[], &channels)?;
        check(&numbers, &counts)
    }
}
