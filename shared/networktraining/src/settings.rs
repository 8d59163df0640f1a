//! Settings of a training.

use serde::{Deserialize, Serialize};

use crate::network::{MULTIPLE, Shape};

/// What calculates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Backend {
    /// Rust only: for tests and small trainings.
    #[default]
    Flex,
    /// LibTorch, on the processor.
    #[cfg(feature = "libtorch")]
    LibTorch,
}

/// The numbers of the maps between layers. Weights, and what is learned of them, are single precision always.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision.
    #[default]
    F32,
    /// Half as many bits: faster where the processor has instructions for it (`avx512_bf16`), much slower elsewhere.
    Bf16,
}

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
    /// What the direction counts beside the maps.
    pub front: f32,
    /// What the expected error counts beside the maps.
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
            front: 0.3,
            error: 0.1,
            vary: Vary::default(),
        }
    }
}

/// A setting that cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{setting} is {got}, expected {expected}")]
pub struct SettingsError {
    /// Its name.
    pub setting: &'static str,
    /// Its value.
    pub got: String,
    /// What is accepted.
    pub expected: String,
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
        let counts = shape
            .channels
            .iter()
            .chain([&shape.stem, &shape.hidden, &self.batch]);
        if let Some(got) = counts.into_iter().find(|it| !(1..=4096).contains(*it)) {
            return Err(SettingsError {
                setting: "a number of channels, of values or of samples",
                got: got.to_string(),
                expected: "1 to 4096".to_owned(),
            });
        }
        let numbers = [
            ("small", self.small, 1.0),
            ("rate", self.rate, 1.0),
            ("decay", self.decay, 1.0),
            ("longest", self.longest, 1e6),
            ("averaged", self.averaged, 1.0),
            ("front", self.front, 1e3),
            ("error", self.error, 1e3),
            ("vary.upright", self.vary.upright, 1.0),
            ("vary.turn_upright", self.vary.turn_upright, 360.0),
            ("vary.turn", self.vary.turn, 360.0),
            ("vary.scale", self.vary.scale, 1.0),
            ("vary.shift", self.vary.shift, 1.0),
            ("vary.covered", self.vary.covered, 1.0),
            ("vary.coarse", self.vary.coarse, 1.0),
            ("vary.grey", self.vary.grey, 1.0),
        ];
        for (setting, value, most) in numbers {
            if !(0.0..=most).contains(&value) {
                let expected = format!("0 to {most}");
                return Err(SettingsError {
                    setting,
                    got: value.to_string(),
                    expected,
                });
            }
        }
        Ok(())
    }
}
