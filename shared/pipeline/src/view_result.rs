//! The result of one view for a frame.

use fmp::{Pose, Responses};
use multiview::FrontEvidence;

/// Position of a keypoint that is not a joint, and its standard deviation along one axis, both in pixels
/// of the frame; `None` if the keypoint was not found.
pub type ExtraKeypoint = Option<([f64; 2], f64)>;

/// The single-view result of one frame, without its evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewResult {
    /// Distinct poses, best first; never empty.
    pub candidates: Vec<Pose>,
    /// Evidence of the picture about the direction in which the person of every candidate faces; empty without an orientation detector.
    pub front: Vec<FrontEvidence>,
    /// Expected error of every part, in pixels of the frame, if predicted.
    pub sigma_px: Option<Vec<f32>>,
    /// Thresholds that came with the prediction, in pixels of the frame; used if the settings contain no thresholds.
    pub tau_px: Option<Vec<f32>>,
    /// Time of the picture after the instant of the frame, in seconds; negative if it was taken before.
    pub skew_s: f64,
}

impl ViewResult {
    /// Returns true if the evidence covers all poses of the result. It may not cover them if a restarted process repeats a frame with
    /// another search window than that of the evidence received earlier.
    pub fn is_within(&self, evidence: &Responses<'_>) -> bool {
        self.candidates.iter().all(|pose| evidence.covers(pose))
    }
}
