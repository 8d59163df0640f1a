//! The settings of the process.

use core::time::Duration;
use std::sync::Arc;

use multiview::ViewPlan;
use pipeline::{Follow, FuseStep, Views};

/// The settings of the process of one worker.
#[derive(Debug)]
pub struct Job {
    /// Index of the worker.
    pub worker: usize,
    /// Grouping of the views: solved in pairs, or all at once.
    pub views: Views,
    /// Choice of the followed person.
    pub follow: Follow,
    /// The pairs of views of this worker: index of the pair in the deployment, and the two views. If all views are solved at once, these
    /// are the views of the pairs.
    pub pairs: Vec<(usize, [usize; 2])>,
    /// The fusion step.
    pub step: Arc<FuseStep>,
    /// The views of the rig.
    pub plans: Vec<Arc<ViewPlan>>,
    /// True if there are processes that send expected errors.
    pub has_quality: bool,
    /// With realtime delivery, the time that a frame waits for expected errors.
    pub quality_deadline: Duration,
    /// Maximum age of a view's last expected errors that may be used instead.
    pub quality_max_age: Duration,
    /// Interval between used frames, in frames of the footage, at least 1.
    pub frame_step: u64,
    /// Number of processes that receive the poses of pairs.
    pub n_consumers: usize,
    /// Time that a view may be silent.
    pub patience: Duration,
}
