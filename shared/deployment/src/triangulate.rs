//! Section `[triangulate]` of a deployment file.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::shipped::SHIPPED;

/// How joints in the world are made of poses in the views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Triangulate")]
pub struct Config {
    /// The set of joints: `parse14`, `umpm15` or `humaneva20`.
    pub joints: String,
    /// Where joints lie among the parts: what `parallax-lab train joints` learned with this model; `"shipped"`: the one for the
    /// model that ships; `"none"`: a joint is the centre of its part, as for other models.
    pub joint_map: PathBuf,
    /// One pose per view out of its pairs': `mean`, as in the paper, or `consensus`.
    pub combine: Combine,
    /// Whether skeletons are human bodies: what no body has is left out, and bones keep their lengths. `false` for a model of
    /// something else.
    pub bodies: bool,
    /// Reprojection error at which an observation begins to count less, pixels.
    pub loss_px: f64,
    /// How much of its expected error makes a view uncertain about a joint, where a network predicts it; 0: not at all.
    pub error_weight: f64,
}

/// How a view's pose is made of those of its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Combine {
    /// Their mean, as in the paper.
    #[default]
    Mean,
    /// Part by part the answers that all views can mean together.
    Consensus,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            joints: "parse14".to_owned(),
            joint_map: PathBuf::from(SHIPPED),
            combine: Combine::default(),
            bodies: true,
            loss_px: geometry::Settings::default().loss_px,
            error_weight: 1.0,
        }
    }
}
