//! Section `[results]` of a deployment file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a run leaves behind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Results")]
pub struct Config {
    /// Write `pose3d.trc` for `OpenSim`, where the frame rate is known.
    pub trc: bool,
    /// Draw every n-th frame of every view; 0 draws none.
    pub overlay_every: u64,
    /// Part whose epipolar lines are drawn, from 1.
    pub epipolar_part: usize,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            trc: true,
            overlay_every: 10,
            epipolar_part: 7,
        }
    }
}
