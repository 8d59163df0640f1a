//! The decoded messages that fusion receives.

use fmp::Pose;
use messages::ViewQuality;
use multiview::FrontEvidence;
use wire::WireError;

/// A decoded message.
#[derive(Debug, Clone)]
pub(crate) enum Input {
    Candidates(Candidates),
    Errors(Errors),
}

/// Poses found in a picture.
#[derive(Debug, Clone)]
pub(crate) struct Candidates {
    /// Distinct poses, best first.
    pub(crate) poses: Vec<Pose>,
    /// For each pose, the evidence in the picture for the direction in which the person faces.
    pub(crate) front: Vec<FrontEvidence>,
    /// Time from the nominal time of the frame until the picture was taken, in seconds.
    pub(crate) skew_s: f64,
}

/// The expected errors of the parts, with their thresholds.
#[derive(Debug, Clone)]
pub(crate) struct Errors {
    pub(crate) sigma_px: Option<Vec<f32>>,
    pub(crate) tau_px: Option<Vec<f32>>,
}

/// Decodes the expected errors of a view.
pub(crate) fn expected_errors(message: &ViewQuality, n_parts: usize) -> Result<Errors, WireError> {
    Ok(Errors {
        sigma_px: wire::sigma_from_message(message, n_parts)?,
        tau_px: wire::tau_from_message(message, n_parts)?,
    })
}
