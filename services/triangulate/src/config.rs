//! Section `[triangulate]` of a deployment file.

use serde::{Deserialize, Serialize};

/// How joints in the world are made of poses in the views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Which joints: `parse14`, `umpm15` or `humaneva20`.
    pub joints: String,
    /// Reprojection error at which an observation begins to count less, pixels.
    pub loss_px: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            joints: "parse14".to_owned(),
            loss_px: geometry::Settings::default().loss_px,
        }
    }
}
