//! The epipolar geometry of two views: fundamental matrices, epipolar lines and curves.

use nalgebra::{Matrix3, Point2, Vector3};

use crate::Camera;

mod curve;

pub use curve::epipolar_curve;

/// Cameras nearer to each other than this, in metres, stand in one place.
const SAME_PLACE: f64 = 1e-9;

/// The fundamental matrix that takes an ideal pixel of A to its line in the ideal pixels of B.
///
/// `F = K_b⁻ᵀ [t]ₓ R K_a⁻¹` with `R`, `t` = B from A (Hartley & Zisserman, 2nd ed., §9.2), scaled to
/// a Frobenius norm of 1. It is the zero matrix if both cameras stand in one place (to a nanometre):
/// then there is no epipolar constraint, and [`epipolar_line`] returns `None`.
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

/// The epipolar line `F x` of a point, with a normal of length 1: `l · (u, v, 1)` is a distance in pixels.
///
/// `None` if the point is the epipole, or F is zero.
pub fn epipolar_line(fundamental: &Matrix3<f64>, point: &Point2<f64>) -> Option<Vector3<f64>> {
    let line = fundamental * point.to_homogeneous();
    let length = line.x.hypot(line.y);
    (length > 0.0 && length.is_finite()).then(|| line / length)
}

/// The distance of a point from a line of [`epipolar_line`], in pixels, never negative.
pub fn point_line_distance(line: &Vector3<f64>, point: &Point2<f64>) -> f64 {
    line.dot(&point.to_homogeneous()).abs()
}

/// How far two ideal pixels are from each other's epipolar lines: `[in A, in B]`, in pixels.
///
/// `fundamental` takes points of A to lines in B. `None` if one of the points is an epipole.
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
