//! Section `[paper]` of a deployment file: the keys that only the paper's method has.

mod consistency;
mod errors;

use core::time::Duration;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::shipped::{SHIPPED, is_none, relative_to};

pub use consistency::{Consistency, RigConsistency};
pub use errors::{ErrorTable, Errors};

/// How long a frame waits for expected errors in real time.
pub const ERRORS_DEADLINE: Duration = Duration::from_millis(50);
/// Age of the last expected errors of a view up to which they stand in for those of a frame; else its parts count.
pub const ERRORS_MAX_AGE: Duration = Duration::from_millis(500);

/// Filters that find people in every view, and the energy that ties the views together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Paper")]
pub struct Config {
    /// The trained model of a person; by default the one that ships.
    pub model: Option<PathBuf>,
    /// Search of a view: `full`, everywhere in every frame; `tracked`, near the last pose, faster and approximate.
    pub search: Search,
    /// Most distinct candidates of a view for fusion.
    pub candidates: usize,
    /// The network that sees in which direction a person faces: a file of `parallax-lab train orientation`, `"shipped"` or `"none"`.
    pub orientation: PathBuf,
    /// Views that are solved together: `pairs`, whose poses are combined, as published; or `all`, 8 at most.
    pub views: Views,
    /// Pairs of cameras to fuse, by name; all if empty.
    pub pairs: Vec<[String; 2]>,
    /// Most fusion processes for the pairs of views.
    pub workers: usize,
    /// How the poses of a view's pairs are combined: `mean`, as published, or `consensus`, the pose that most views support.
    pub combine: Combine,
    /// The energy that ties two views together: the `paper`'s, or that of the authors' `released` program.
    pub energy: Energy,
    /// Weight of the geometric term; by default as learned, or 0.002 per squared cell (`paper`) or 0.07 (`released`).
    pub alpha: Option<f64>,
    /// Weight of the part-type term; by default as learned, or 0.03.
    pub beta: Option<f64>,
    /// Result of `parallax-lab train consistency`: a file, `"shipped"`, or `{ file = FILE, rig = NAME }` with the tables of a named rig.
    pub consistency: Option<Consistency>,
    /// Part-type tables of pairs of cameras, each `{ views = [a, b], files = [a wrt b, b wrt a] }`.
    pub compatibility: Vec<Compatibility>,
    /// Expected errors of the parts: a network (ONNX, or `"shipped"`), or `{ table = FILE, subject, action, views, frame_offset, frame_step }`.
    pub errors: Option<Errors>,
    /// Expected error above which a part is switched off: `none`, `learned`, the name of a data set, pixels of each part, or `{ file = FILE }`.
    pub tau: Tau,
    /// View whose expected error switches a part off: `either`, as published, the `support`, or the support if it is the `worse`.
    pub switch: Switch,
    /// Decide for every view whether it sees the person from behind.
    pub facing: bool,
    /// Places of joints among the parts: a file of `parallax-lab train joints`, `"shipped"`, or `"none"` for the centres of parts.
    pub joint_map: PathBuf,
    /// Treat the model as a human body: bones keep their lengths, and impossible joints are left out.
    pub bodies: bool,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            model: None,
            search: Search::Full,
            candidates: 8,
            orientation: PathBuf::from(SHIPPED),
            views: Views::Pairs,
            pairs: Vec::new(),
            workers: 1,
            combine: Combine::Mean,
            energy: Energy::Paper,
            alpha: None,
            beta: None,
            consistency: None,
            compatibility: Vec::new(),
            errors: None,
            tau: Tau::Named(TauName::None),
            switch: Switch::Either,
            facing: true,
            joint_map: PathBuf::from(SHIPPED),
            bodies: true,
        }
    }
}

impl Config {
    /// Takes every relative path as relative to `base`.
    pub fn resolve(&mut self, base: &Path) {
        let consistency = self.consistency.as_mut().map(Consistency::file_mut);
        for file in self.model.as_mut().into_iter().chain(consistency) {
            *file = relative_to(file, base);
        }
        for file in [&mut self.orientation, &mut self.joint_map] {
            if !is_none(file) {
                *file = relative_to(file, base);
            }
        }
        match &mut self.errors {
            Some(Errors::Network(file)) => *file = relative_to(file, base),
            Some(Errors::Table(errors)) => errors.table = base.join(&errors.table),
            None => {}
        }
        if let Tau::File(tau) = &mut self.tau {
            tau.file = base.join(&tau.file);
        }
        for file in self.compatibility.iter_mut().flat_map(|tables| &mut tables.files) {
            *file = base.join(&file);
        }
    }
}

/// How a view is searched for poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Search {
    /// Every frame on all levels and everywhere, as published.
    #[default]
    Full,
    /// Near the best pose of the last frame, and in full now and then: faster, and approximate.
    Tracked,
}

/// Views that the paper's method solves at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Views {
    /// Pairs, whose poses are then combined, as published.
    #[default]
    Pairs,
    /// All views, each supported by all others.
    All,
}

/// How a view's pose is made of those of its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Combine {
    /// Their mean, as published.
    #[default]
    Mean,
    /// Part by part the answers that all views can mean together.
    Consensus,
}

/// Which energy ties two views together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Energy {
    /// The paper's.
    #[default]
    Paper,
    /// The energy that the authors' program computes.
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
