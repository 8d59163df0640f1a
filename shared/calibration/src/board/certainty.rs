//! Standard deviations of corners where the pictures of a frame were not taken at the same time.

use std::collections::BTreeMap;

use super::Sight;

/// How far apart in time the pictures of one frame are, frames: a standard deviation of cameras that start at will.
const APART: f64 = 0.5;
/// Corners of a board that stands still move by less between two pictures, in standard deviations of a corner.
const STILL_SIGMAS: f64 = 2.0;
/// The assumed speed of a board that no other picture shows, pixels a frame.
const UNKNOWN_PX: f64 = 100.0;

/// Amount by which the standard deviation of a corner is larger than that of a board that stands still.
///
/// All corners of a board that moved between two pictures of a frame are off together, so that a sight says no more
/// about that than one corner would.
///
/// * `speeds`: of the board, pixels a frame, by camera and frame.
/// * `sigma_px`: standard deviation of a corner, pixels.
pub(super) fn spread(sight: &Sight, speeds: &BTreeMap<(usize, usize), f64>, sigma_px: f64) -> f64 {
    let speed = speeds.get(&(sight.camera, sight.frame));
    let speed = speed.unwrap_or(&UNKNOWN_PX) / sigma_px.max(0.01);
    let moved = (speed.powi(2) - STILL_SIGMAS.powi(2)).max(0.0);
    (1.0 + sight.points.len() as f64 * APART.powi(2) * moved).sqrt()
}
