//! Standard deviations of corners if the pictures of a frame were not taken at the same time.

use std::collections::BTreeMap;

use super::Sight;

/// Standard deviation of the time between pictures of one frame, in frames, for cameras that start independently.
const APART: f64 = 0.5;
/// A board counts as standing still if its corners move less than this between two pictures, in standard deviations of a corner's position.
const STILL_SIGMAS: f64 = 2.0;
/// Assumed speed of a board that is seen in one picture only, in pixels per frame.
const UNKNOWN_PX: f64 = 100.0;

/// Returns the factor by which the standard deviation of a corner is larger than for a board that stands still.
///
/// If a board moved between two pictures of a frame, all its corners share the same error. All corners of one picture together therefore
/// give no more information about this error than a single corner.
///
/// * `speeds`: speed of the board in pixels per frame, by camera and frame.
/// * `sigma_px`: standard deviation of a corner, in pixels.
pub(super) fn spread(sight: &Sight, speeds: &BTreeMap<(usize, usize), f64>, sigma_px: f64) -> f64 {
    let speed = speeds.get(&(sight.camera, sight.frame));
    let speed = speed.unwrap_or(&UNKNOWN_PX) / sigma_px.max(0.01);
    let moved = (speed.powi(2) - STILL_SIGMAS.powi(2)).max(0.0);
    (1.0 + sight.points.len() as f64 * APART.powi(2) * moved).sqrt()
}
