//! The standard deviation of an angle from the covariances of its joints.

use nalgebra::{Matrix3, Vector3};

use super::Unknown;

/// A position and its covariance.
pub(super) type Place = (Vector3<f64>, Option<Matrix3<f64>>);

/// Returns the standard deviation of `angle` for joints with independent errors; `None` if a covariance is unknown.
///
/// The method is second-order divided differences (Nørgaard, Poulsen & Ravn 2000): the angle is also computed with each joint displaced by
/// sqrt(3) standard deviations in both directions along every axis of its covariance. Unlike derivatives, these differences respond to the
/// curvature of an angle, such as that of a nearly straight knee. Unlike in the unscented transform, the steps do not grow with the number
/// of joints.
///
/// # Errors
///
/// [`Unknown::Uncertain`] if the angle is undefined within the uncertainty of the joints.
pub(super) fn sd(
    centre: f64,
    places: &[Place],
    angle: impl Fn(&[Vector3<f64>]) -> Option<f64>,
) -> Result<Option<f64>, Unknown> {
    let mut points: Vec<Vector3<f64>> = places.iter().map(|place| place.0).collect();
    let step2 = 3.0;
    let mut variance = 0.0;
    for joint in 0..places.len() {
        let (place, covariance) = places[joint];
        let Some(covariance) = covariance else {
            return Ok(None);
        };
        let axes = covariance.symmetric_eigen();
        for axis in 0..3 {
            let length = (axes.eigenvalues[axis].max(0.0) * step2).sqrt();
            let step = axes.eigenvectors.column(axis) * length;
            let mut at = |point: Vector3<f64>| {
                points[joint] = point;
                let there = angle(&points).ok_or(Unknown::Uncertain)?;
                Ok(turned(there - centre))
            };
            let (more, less) = (at(place + step)?, at(place - step)?);
            variance += (more - less).powi(2) / (4.0 * step2)
                + (step2 - 1.0) / (4.0 * step2 * step2) * (more + less).powi(2);
        }
        points[joint] = place;
    }
    Ok(Some(variance.sqrt()))
}

/// Wraps a difference of angles to the range from -180 to 180 degrees.
fn turned(degrees: f64) -> f64 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
}
