//! Task of the process.

use core::time::Duration;
use std::sync::Arc;

use multiview::ViewPlan;
use pipeline::{Follow, FuseStep, Views};

/// Task of the process of one worker.
#[derive(Debug)]
pub struct Job {
    /// The worker.
    pub worker: usize,
    /// Grouping of the views: solved in pairs or all at once.
    pub views: Views,
    /// Which of several people is followed.
    pub follow: Follow,
    /// Its pairs: index in the deployment, and views. If all views are solved at once: the views of these pairs.
    pub pairs: Vec<(usize, [usize; 2])>,
    /// The fusion step.
    pub step: Arc<FuseStep>,
    /// The views of the rig.
    pub plans: Vec<Arc<ViewPlan>>,
    /// True if there are processes that send expected errors.
    pub has_quality: bool,
    /// How long a frame waits for expected errors where the latest frame wins.
    pub quality_deadline: Duration,
    /// Largest age of the last expected errors of a view that may be used instead.
    pub quality_max_age: Duration,
    /// Distance between the frames used, at least 1.
    pub frame_step: u64,
    /// Processes that receive the poses of pairs.
    pub n_consumers: usize,
    /// How long a view may be silent.
    pub patience: Duration,
}
