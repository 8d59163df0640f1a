//! Section `[fuse]` of a deployment file.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// The energy that ties the views together, and its optimiser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Which energy.
    pub energy: Energy,
    /// Weight of the geometric term.
    pub alpha: Option<f64>,
    /// Weight of the part-type term.
    pub beta: f64,
    /// Distance beyond which the geometric term grows no more, cells.
    pub max_distance_cells: Option<f64>,
    /// Part-type tables, a pair of views each.
    pub compatibility: Vec<Compatibility>,
    /// Expected error above which a part is switched off, pixels, one per part.
    pub tau_px: Vec<f32>,
    /// Decide for every view whether it sees the person from behind.
    pub facing: bool,
    /// Fusion processes; the pairs are dealt to them in turn.
    pub workers: usize,
    /// Most single-view solutions of a pair.
    pub max_iterations: usize,
    /// Mean movement below which a view counts as settled, pixels.
    pub epsilon_px: f64,
    /// Pairs of cameras to fuse, by name; all pairs if empty.
    pub pairs: Vec<[String; 2]>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            energy: Energy::Paper,
            alpha: None,
            beta: 0.03,
            max_distance_cells: None,
            compatibility: Vec::new(),
            tau_px: Vec::new(),
            facing: true,
            workers: 1,
            max_iterations: 12,
            epsilon_px: 0.1,
            pairs: Vec::new(),
        }
    }
}

/// Which energy ties two views together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Energy {
    /// The paper's.
    #[default]
    Paper,
    /// What the authors' program computes.
    Released,
}

/// The part-type tables of one pair of views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Compatibility {
    /// The two cameras, by name.
    pub views: [String; 2],
    /// `[first with respect to second, second with respect to first]`: rows are the types of the
    /// first-named view of each.
    pub files: [PathBuf; 2],
}
