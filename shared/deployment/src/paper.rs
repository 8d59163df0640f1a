//! Section `[paper]` of a deployment file: the keys of the paper's method.

mod consistency;
mod errors;

use core::time::Duration;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::shipped::{SHIPPED, is_none, relative_to};

pub use consistency::{Consistency, RigConsistency};
pub use errors::{ErrorTable, Errors};

/// Time that a frame waits for expected errors in real time.
pub const ERRORS_DEADLINE: Duration = Duration::from_millis(50);
/// Maximum age of a view's last expected errors for use with a later frame. If they are older, no part is switched off.
pub const ERRORS_MAX_AGE: Duration = Duration::from_millis(500);

/// Filters that find people in every view, and the energy that links the views.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Paper")]
pub struct Config {
    /// Trained model of a person; by default, the shipped one.
    pub model: Option<PathBuf>,
    /// How a view is searched: `full`, everywhere in every frame; `tracked`, near the last pose, which is faster but approximate.
    pub search: Search,
    /// Maximum number of distinct candidates of a view for fusion.
    pub candidates: usize,
    /// Network that estimates the direction in which a person faces: a file from `parallax-lab train orientation`, `"shipped"` or `"none"`.
    pub orientation: PathBuf,
    /// Views that are solved together: the two views of each pair, whose poses are then combined, as published (`pairs`); or all views, at
    /// most 8 (`all`).
    pub views: Views,
    /// Names of the pairs of cameras to fuse; if empty, all pairs.
    pub pairs: Vec<[String; 2]>,
    /// Maximum number of fusion processes for the pairs of views.
    pub workers: usize,
    /// How the poses of a view's pairs are combined: `mean`, as published, or `consensus`, the pose that most views support.
    pub combine: Combine,
    /// Energy that links two views: the energy of the `paper`, or that of the authors' `released` program.
    pub energy: Energy,
    /// Weight of the geometric term; by default, the learned weight; without one, 0.002 per squared cell (`paper`) or 0.07 (`released`).
    pub alpha: Option<f64>,
    /// Weight of the part-type term; by default, the learned weight; without one, 0.03.
    pub beta: Option<f64>,
    /// Result of `parallax-lab train consistency`: a file, `"shipped"`, or `{ file = FILE, rig = NAME }` to use the tables of a named rig.
    pub consistency: Option<Consistency>,
    /// Part-type tables of pairs of cameras, each `{ views = [a, b], files = [a wrt b, b wrt a] }`.
    pub compatibility: Vec<Compatibility>,
    /// Source of the expected errors of the parts: a network (ONNX, or `"shipped"`), or
    /// `{ table = FILE, subject, action, views, frame_offset, frame_step }`.
    pub errors: Option<Errors>,
    /// Expected error above which a part is switched off: `none`, `learned`, the name of a data set, a list with a value in pixels for each
    /// part, or `{ file = FILE }`.
    pub tau: Tau,
    /// View whose expected error can switch a part off: `either` view, as published; only the supporting view (`support`); or only the
    /// supporting view, if its error is the larger one (`worse`).
    pub switch: Switch,
    /// Decide for every view whether the person is seen from behind.
    pub facing: bool,
    /// Positions of joints relative to the parts: a file from `parallax-lab train joints`, `"shipped"`, or `"none"` for the centres of
    /// parts.
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
    /// Resolves every relative path against `base`.
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
    /// Every frame is searched everywhere and on all levels, as published.
    #[default]
    Full,
    /// Frames are searched near the best pose of the last frame, and in full now and then: faster, but approximate.
    Tracked,
}

/// Views that the paper's method solves together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Views {
    /// Pairs of views, whose poses are then combined, as published.
    #[default]
    Pairs,
    /// All views at once, each supported by all others.
    All,
}

/// How the poses of a view's pairs are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Combine {
    /// The mean of the poses, as published.
    #[default]
    Mean,
    /// For each part, the positions that agree across all views.
    Consensus,
}

/// Energy that links two views.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Energy {
    /// The energy of the paper.
    #[default]
    Paper,
    /// The energy of the authors' released program.
    Released,
}

/// View whose expected error switches a part off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Switch {
    /// Either view, as in the paper.
    #[default]
    Either,
    /// The view that supports the other.
    Support,
    /// The supporting view, if its expected error is also the larger of the two.
    Worse,
}

/// Thresholds of the expected error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"none\", \"learned\", \"humaneva\", \"humaneva-median\", \"umpm\", \"umpm-median\", a list with one number per \
                 part, or { file = \"...\" }"
)]
pub enum Tau {
    /// Thresholds with a known name.
    Named(TauName),
    /// One threshold per part, in pixels of the footage.
    Given(Vec<f32>),
    /// Thresholds in a file.
    File(TauFile),
}

/// A file with thresholds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TauFile {
    /// File of numbers separated by white space or commas, in pixels of the footage; `#` begins a comment.
    pub file: PathBuf,
}

/// Thresholds with a known name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum TauName {
    /// No part is ever switched off.
    #[serde(rename = "none")]
    None,
    /// Thresholds from the file that `paper.consistency` names, in tenths of the person's size.
    #[serde(rename = "learned")]
    Learned,
    /// Thresholds of the authors' program for `HumanEva`: median training error plus inaccuracy.
    #[serde(rename = "humaneva")]
    HumanEva,
    /// Thresholds of the paper for `HumanEva`: the median training error alone.
    #[serde(rename = "humaneva-median")]
    HumanEvaMedian,
    /// Thresholds of the authors' program for UMPM.
    #[serde(rename = "umpm")]
    Umpm,
    /// Thresholds of the paper for UMPM: the median training error alone.
    #[serde(rename = "umpm-median")]
    UmpmMedian,
}

impl Tau {
    /// Returns the thresholds listed in the deployment itself, one per part, in pixels of the footage. The slice is empty if the
    /// thresholds are known by name or are in a file.
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
    /// Names of the two cameras.
    pub views: [String; 2],
    /// `[first with respect to second, second with respect to first]`. The rows of each table are the types of the view named first.
    pub files: [PathBuf; 2],
}
