//! What the process has to do.

use core::time::Duration;

use pipeline::ViewStep;

/// What one view's process has to do.
#[derive(Debug)]
pub struct Job {
    /// The view.
    pub view: usize,
    /// The single-view step.
    pub step: ViewStep,
    /// Processes that receive the candidates.
    pub n_pose_consumers: usize,
    /// Processes that receive the evidence.
    pub n_evidence_consumers: usize,
    /// First frame that is used.
    pub start_frame: u64,
    /// Distance between the frames used.
    pub frame_step: u64,
    /// Frame rate of the footage, if known; limits how far a pose may have moved.
    pub frame_rate_hz: Option<f64>,
    /// How long the process waits for receivers.
    pub patience: Duration,
}
