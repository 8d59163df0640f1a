//! Section `[fuse]` of a deployment file.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Deployment, triangulate};

/// The energy that ties the views together, and its optimiser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Fuse")]
pub struct Config {
    /// `paper`: the paper's; `released`: what the authors' program computes.
    pub energy: Energy,
    /// `pairs`: pairs of views, then combined, as in the paper; `all`: every view with all others at once; `space`: the maps of
    /// `pose.network` with bones in space. Without it: `space` with maps; else `all` of 3 to 8 cameras, unless another key is set
    /// that pairs alone have (`energy`, `pairs`, `workers`, `combine`).
    pub views: Option<Views>,
    /// What `parallax-lab train consistency` learned, or `"shipped"`: part-type tables, weights, thresholds, joints.
    pub consistency: Option<PathBuf>,
    /// Rig of that file whose cameras these are; tables go by the angle between two cameras without it.
    pub consistency_rig: Option<String>,
    /// Weight of the geometric term; as learned, else 0.002 per squared cell (paper), 0.07 (released).
    pub alpha: Option<f64>,
    /// Weight of the part-type term; as learned, else 0.03.
    pub beta: Option<f64>,
    /// Distance beyond which the geometric term grows no more; as learned, else none.
    pub max_distance_cells: Option<f64>,
    /// Part-type tables: `views = [a, b]`, `files = [a wrt b, b wrt a]`.
    pub compatibility: Vec<Compatibility>,
    /// Expected error that switches a part off: none, learned, humaneva, humaneva-median, umpm, umpm-median, one per
    /// part or `{ file = "..." }`, pixels of the footage.
    pub tau: Tau,
    /// Whose expected error switches a part off: either view's (the paper), the support's, or the support's where it
    /// is the worse of the two.
    pub switch: Switch,
    /// Decide for every view whether it sees the person from behind.
    pub facing: bool,
    /// Most fusion processes; pairs of views are dealt to them in turn, all views at once need one.
    pub workers: usize,
    /// Most single-view solutions of a pair; of all views at once, half as many of every view.
    pub max_iterations: usize,
    /// Mean movement below which a view counts as settled, pixels.
    pub epsilon_px: f64,
    /// Pairs of cameras to fuse, by name; all if empty.
    pub pairs: Vec<[String; 2]>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            energy: Energy::Paper,
            views: None,
            consistency: None,
            consistency_rig: None,
            alpha: None,
            beta: None,
            max_distance_cells: None,
            compatibility: Vec::new(),
            tau: Tau::Named(TauName::None),
            switch: Switch::Either,
            facing: true,
            workers: 1,
            max_iterations: 12,
            epsilon_px: 0.1,
            pairs: Vec::new(),
        }
    }
}

/// Most cameras that can be solved at once.
pub(crate) const MOST_AT_ONCE: usize = 8;

impl Deployment {
    /// What the views of a frame are solved in: what the file says; else all at once from three cameras on, if nothing is
    /// asked for that only pairs have.
    pub fn views(&self) -> Views {
        let needs_pairs = self.needs_pairs();
        match self.fuse.views {
            Some(views) => views,
            None if self.has_maps() && !needs_pairs => Views::Space,
            None if needs_pairs || !(3..=MOST_AT_ONCE).contains(&self.cameras.len()) => {
                Views::Pairs
            }
            None => Views::All,
        }
    }

    /// Whether there is a setting that only pairs of views have.
    pub(crate) fn needs_pairs(&self) -> bool {
        let fuse = &self.fuse;
        fuse.energy != Energy::Paper
            || !fuse.pairs.is_empty()
            || fuse.workers > 1
            || self.triangulate.combine != triangulate::Combine::Mean
    }

    /// Most fusion processes that have something to do: all views at once are one piece of work.
    pub(crate) fn most_workers(&self) -> usize {
        match self.views() {
            Views::Pairs => self.fuse.workers,
            Views::All | Views::Space => 1,
        }
    }
}

/// What the views of a frame are solved in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Views {
    /// Pairs, whose poses are then combined, as in the paper.
    Pairs,
    /// All at once, every view supported by all others.
    All,
    /// All at once, in space, over the maps of networks.
    Space,
}

/// Which energy ties two views together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Energy {
    /// The paper's.
    #[default]
    Paper,
    /// What the authors' program computes.
    Released,
}

/// Whose expected error switches a part off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Switch {
    /// That of either view, as in the paper.
    #[default]
    Either,
    /// That of the view that supports the other.
    Support,
    /// The same, where it is also the worse of the two.
    Worse,
}

/// Thresholds of the expected error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"none\", \"learned\", \"humaneva\", \"humaneva-median\", \"umpm\", \"umpm-median\", \
                 one number per part, or { file = \"...\" }"
)]
pub enum Tau {
    /// Thresholds that are known by name.
    Named(TauName),
    /// Pixels of the footage, one per part.
    Given(Vec<f32>),
    /// The same from a file.
    File(TauFile),
}

/// A file with thresholds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TauFile {
    /// Numbers separated by white space or commas, pixels of the footage; `#` begins a comment.
    pub file: PathBuf,
}

/// Thresholds that are known by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum TauName {
    /// No part is ever switched off.
    #[serde(rename = "none")]
    None,
    /// Those of the file `consistency`, in tenths of the person's size.
    #[serde(rename = "learned")]
    Learned,
    /// Those of the authors' program for `HumanEva`: median training error plus inaccuracy.
    #[serde(rename = "humaneva")]
    HumanEva,
    /// The paper's rule for `HumanEva`: the median training error alone.
    #[serde(rename = "humaneva-median")]
    HumanEvaMedian,
    /// Those of the authors' program for UMPM.
    #[serde(rename = "umpm")]
    Umpm,
    /// The paper's rule for UMPM.
    #[serde(rename = "umpm-median")]
    UmpmMedian,
}

impl Tau {
    /// The thresholds that the deployment gives itself, one per part, pixels of the footage; none where they are known
    /// by name or are in a file.
    pub fn given(&self) -> &[f32] {
        match self {
            Self::Given(px) => px,
            Self::Named(_) | Self::File(_) => &[],
        }
    }
}

/// The part-type tables of one pair of views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Compatibility {
    /// The two cameras, by name.
    pub views: [String; 2],
    /// `[first with respect to second, second with respect to first]`: rows are the types of the
    /// first-named view of each.
    pub files: [PathBuf; 2],
}
