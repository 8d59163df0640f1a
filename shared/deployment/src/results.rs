//! Section `[results]` of a deployment file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The files that a run writes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Results")]
pub struct Config {
    /// Draw overlays of every n-th frame of every view; 0 draws none.
    pub overlay_every: u64,
    /// Write smoothed joints during the run, to `pose3d-smooth.jsonl`.
    pub smooth: bool,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            overlay_every: 10,
            smooth: false,
        }
    }
}
