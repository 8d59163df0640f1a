//! What the process has to do.

use core::time::Duration;
use std::sync::Arc;

use multiview::ViewPlan;
use pipeline::{FuseStep, Views};

/// What one worker's process has to do.
#[derive(Debug)]
pub struct Job {
    /// The worker.
    pub worker: usize,
    /// What the views are solved in.
    pub views: Views,
    /// Its pairs: their index in the deployment, and their views. All views at once read the views of these.
    pub pairs: Vec<(usize, [usize; 2])>,
    /// The fusion step.
    pub step: Arc<FuseStep>,
    /// The views of the rig.
    pub plans: Vec<Arc<ViewPlan>>,
    /// Whether there are processes that send expected errors.
    pub has_quality: bool,
    /// How long a frame waits for expected errors where the latest wins.
    pub quality_deadline: Duration,
    /// How old the last ones of a view may be to be used instead.
    pub quality_max_age: Duration,
    /// Distance between the frames used, at least 1.
    pub frame_step: u64,
    /// Processes that receive the poses of pairs.
    pub n_consumers: usize,
    /// How long a view may be silent.
    pub patience: Duration,
}
