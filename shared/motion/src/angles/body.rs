//! Frames of reference of the trunk, and directions in them.

use nalgebra::{Matrix3, Vector3};

/// Minimum length of a segment for its direction to be computed, in metres.
const SHORTEST_M: f64 = 0.01;

/// Returns the direction from one point to another; `None` if they are at the same place.
pub(super) fn direction(from: &Vector3<f64>, to: &Vector3<f64>) -> Option<Vector3<f64>> {
    (to - from).try_normalize(SHORTEST_M)
}

/// Returns the axes x forwards, y upwards, z to the right as columns, after Wu et al. The upward direction is kept, and the direction to
/// the right is made perpendicular to it.
pub(super) fn axes_up(up: &Vector3<f64>, right: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let z = (right - up * up.dot(right)).try_normalize(super::LEAST_TILT)?;
    Some(Matrix3::from_columns(&[up.cross(&z), *up, z]))
}

/// Like [`axes_up`], but the direction to the right is kept, and the upward direction is made perpendicular to it.
pub(super) fn axes_right(right: &Vector3<f64>, up: &Vector3<f64>) -> Option<Matrix3<f64>> {
    let y = (up - right * right.dot(up)).try_normalize(super::LEAST_TILT)?;
    Some(Matrix3::from_columns(&[y.cross(right), y, *right]))
}

/// Returns the angle between two unit vectors, in degrees; it is accurate near 0 and 180, too.
pub(super) fn between(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b)).to_degrees()
}
