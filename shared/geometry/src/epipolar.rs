//! Epipolar geometry of two views: fundamental matrices, epipolar lines and curves.

use nalgebra::{Matrix3, Point2, Vector3};

use crate::Camera;

mod curve;

pub use curve::epipolar_curve;

/// Distance below which two cameras count as being in the same place, in metres.
const SAME_PLACE: f64 = 1e-9;

/// Returns the fundamental matrix, which maps an ideal pixel of A to its epipolar line in the ideal pixels of B.
///
/// `F = K_b⁻ᵀ [t]ₓ R K_a⁻¹` with `R`, `t` = B from A (Hartley & Zisserman, 2nd ed., §9.2), scaled to a Frobenius norm of 1. It is the
/// zero matrix if both cameras are in the same place (to a nanometre). There is then no epipolar constraint, and [`epipolar_line`]
/// returns `None`.
pub fn fundamental(a: &Camera, b: &Camera) -> Matrix3<f64> {
    let b_from_a = b.camera_from_world * a.camera_from_world.inverse();
    if b_from_a.translation.vector.norm() < SAME_PLACE {
        return Matrix3::zeros();
    }
    let rotation = b_from_a.rotation.to_rotation_matrix();
    let essential = b_from_a.translation.vector.cross_matrix() * rotation.matrix();
    let fundamental = inverse_calibration(b).transpose() * essential * inverse_calibration(a);
    fundamental.try_normalize(0.0).unwrap_or_else(Matrix3::zeros)
}

fn inverse_calibration(camera: &Camera) -> Matrix3<f64> {
    let i = &camera.intrinsics;
    Matrix3::new(
        1.0 / i.fx,
        0.0,
        -i.cx / i.fx,
        0.0,
        1.0 / i.fy,
        -i.cy / i.fy,
        0.0,
        0.0,
        1.0,
    )
}

/// Returns the epipolar line `F x` of a point, with a normal of length 1, so that `l · (u, v, 1)` is a distance in pixels.
///
/// Returns `None` if the point is the epipole, or F is zero.
pub fn epipolar_line(fundamental: &Matrix3<f64>, point: &Point2<f64>) -> Option<Vector3<f64>> {
    let line = fundamental * point.to_homogeneous();
    let length = line.x.hypot(line.y);
    (length > 0.0 && length.is_finite()).then(|| line / length)
}

/// Returns the distance of a point from a line of [`epipolar_line`], in pixels; never negative.
pub fn point_line_distance(line: &Vector3<f64>, point: &Point2<f64>) -> f64 {
    line.dot(&point.to_homogeneous()).abs()
}

/// Returns the distances of two ideal pixels from each other's epipolar lines: `[in A, in B]`, in pixels.
///
/// `fundamental` takes points of A to lines in B. Returns `None` if one of the points is an epipole.
pub fn symmetric_distance(
    fundamental: &Matrix3<f64>,
    in_a: &Point2<f64>,
    in_b: &Point2<f64>,
) -> Option<[f64; 2]> {
    let line_in_a = epipolar_line(&fundamental.transpose(), in_b)?;
    let line_in_b = epipolar_line(fundamental, in_a)?;
    Some([
        point_line_distance(&line_in_a, in_a),
        point_line_distance(&line_in_b, in_b),
    ])
}

#[cfg(test)]
mod tests;
