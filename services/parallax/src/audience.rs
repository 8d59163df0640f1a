//! Who listens to whom: which stages run, what stands in for the others, and how many take what they send.

use std::path::PathBuf;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::plan::{Dealing, Resolved};

/// The file that every message of a run goes to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Tape {
    /// Its name, absolute.
    pub file: PathBuf,
    /// Whether the pixels of frames are left out.
    pub without_pixels: bool,
    /// Whether evidence is left out.
    pub without_evidence: bool,
    /// Bytes that may wait to be written, in millions.
    pub queue_mb: u64,
}

/// A stage of the pipeline, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Stage {
    /// From the footage on: nothing of the recording is sent.
    Capture,
    /// The frames are given.
    Pose,
    /// And the single-view poses, and their evidence.
    Quality,
    /// And the expected errors.
    Fuse,
    /// And the answers of all pairs.
    Triangulate,
}

impl Stage {
    /// The service, and the section of its settings.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Capture => "capture",
            Self::Pose => "pose",
            Self::Quality => "quality",
            Self::Fuse => "fuse",
            Self::Triangulate => "triangulate",
        }
    }

    /// The stage of a service; none for those that no recording stands in for.
    pub(crate) fn of_service(service: &str) -> Option<Self> {
        let mut all = Self::value_variants().iter().copied();
        all.find(|it| it.name() == service)
    }
}

/// A recording that stands in for the first stages of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Replay {
    /// Its name, absolute.
    pub file: PathBuf,
    /// The first stage that runs for real.
    pub from: Stage,
    /// How many times as fast as it was recorded; as fast as can be without it.
    pub speed: Option<f64>,
}

/// The processes of a deployment, as those see them that send.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Audience<'a> {
    resolved: &'a Resolved,
    dealing: &'a Dealing,
}

impl<'a> Audience<'a> {
    /// Of a deployment whose pairs have been dealt.
    pub(crate) fn new(resolved: &'a Resolved, dealing: &'a Dealing) -> Self {
        Self { resolved, dealing }
    }

    /// So many, if the stage runs; what stands in for one listens to nobody.
    fn real(self, stage: Stage, n: usize) -> usize {
        if self.resolved.runs(stage) { n } else { 0 }
    }

    /// Processes that take everything: `results`, and `record` if there is one.
    pub(crate) fn n_recorders(self) -> usize {
        1 + usize::from(self.resolved.tape.is_some())
    }

    /// Processes that take the frames of a view.
    pub(crate) fn of_frames(self) -> usize {
        let looks = usize::from(self.resolved.has_network());
        self.real(Stage::Pose, 1) + self.real(Stage::Quality, looks) + self.n_recorders()
    }

    /// Processes that take the candidates of a view.
    pub(crate) fn of_poses(self) -> usize {
        let quality = usize::from(self.resolved.has_quality());
        self.real(Stage::Quality, quality)
            + self.real(Stage::Fuse, self.dealing.n_workers)
            + self.real(Stage::Triangulate, 1)
            + self.n_recorders()
    }

    /// Processes that take the evidence of a view.
    pub(crate) fn of_evidence(self, view: usize) -> usize {
        let tape = self.resolved.tape.as_ref();
        let is_taped = tape.is_some_and(|it| !it.without_evidence);
        self.real(Stage::Fuse, self.dealing.readers_of(view)) + usize::from(is_taped)
    }

    /// Processes that take the expected errors of a view.
    pub(crate) fn of_qualities(self) -> usize {
        self.real(Stage::Fuse, self.dealing.n_workers) + self.n_recorders()
    }

    /// Processes that take the answers of a worker.
    pub(crate) fn of_pairs(self) -> usize {
        self.real(Stage::Triangulate, 1) + self.n_recorders()
    }

    /// Processes that take the result.
    pub(crate) fn of_results(self) -> usize {
        self.n_recorders()
    }
}
