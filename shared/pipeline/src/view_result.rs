//! Result of one view for a frame.

use fmp::{Pose, Responses};
use multiview::FrontEvidence;

/// Where a keypoint that is not a joint was found, and the standard deviation of the place along one axis, both pixels
/// of the frame; `None` where it was not.
pub type ExtraKeypoint = Option<([f64; 2], f64)>;

/// The single-view result of one frame, besides its evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewResult {
    /// Distinct poses, best first; never empty.
    pub candidates: Vec<Pose>,
    /// Evidence of the picture about the direction in which the person of every candidate faces; empty without a detector of it.
    pub front: Vec<FrontEvidence>,
    /// Expected error of every part, pixels of the frame, if there is a prediction.
    pub sigma_px: Option<Vec<f32>>,
    /// Thresholds that came with the prediction, pixels of the frame; used where the settings have
    /// none.
    pub tau_px: Option<Vec<f32>>,
    /// How long after the instant of the frame the picture was taken, seconds; negative for before.
    pub skew_s: f64,
}

impl ViewResult {
    /// Returns true if all its poses lie where there is evidence. They may not: a restarted process can repeat a frame with
    /// another search window than the process whose evidence arrived before.
    pub fn is_within(&self, evidence: &Responses<'_>) -> bool {
        self.candidates.iter().all(|pose| evidence.covers(pose))
    }
}
