//! Section `[smooth]` of a deployment file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How trajectories are smoothed: by `parallax smooth` after a run, and live if asked for. What was measured always stays.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Smooth")]
pub struct Config {
    /// How `parallax smooth` does it: `rts`, a smoother on the measured covariances that looks ahead; `butterworth`, a zero-phase
    /// low-pass filter; `kalman`, as it would have been live; `none`, only angles are computed.
    pub method: Method,
    /// What is written while the run lasts, into `pose3d-smooth.jsonl`: `off` nothing; `kalman`, filters on the measured covariances.
    pub live: Live,
    /// Cutoff of `butterworth`, Hz.
    pub cutoff_hz: f64,
    /// The longest time between two measurements of a joint that is filled, seconds.
    pub fill_s: f64,
    /// Whether `rts` keeps the lengths of the limbs' bones constant over the run.
    pub constant_bones: bool,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            method: Method::Rts,
            live: Live::Off,
            cutoff_hz: 6.0,
            fill_s: 0.25,
            constant_bones: false,
        }
    }
}

/// How a finished run is smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// With everything before and after, on the measured covariances.
    #[default]
    Rts,
    /// By a zero-phase low-pass filter.
    Butterworth,
    /// By causal filters on the measured covariances.
    Kalman,
    /// Not at all.
    None,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Rts, Self::Butterworth, Self::Kalman, Self::None];

    /// The word of the deployment file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rts => "rts",
            Self::Butterworth => "butterworth",
            Self::Kalman => "kalman",
            Self::None => "none",
        }
    }
}

/// How a run is smoothed while it lasts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Live {
    /// Not at all.
    #[default]
    Off,
    /// By Kalman filters on the measured covariances.
    Kalman,
}

impl Live {
    /// The word of the deployment file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Kalman => "kalman",
        }
    }
}
