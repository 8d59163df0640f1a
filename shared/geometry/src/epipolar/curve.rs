//! The image of a viewing ray in another, distorted view.

use nalgebra::Point2;

use crate::Camera;

/// The curve in the recorded image of B on which the point seen in a pixel of A must lie.
pub fn epipolar_curve(
    a: &Camera,
    b: &Camera,
    point_in_a: &Point2<f64>,
    n: usize,
) -> Vec<Point2<f64>> {
    let (_, _, _, _) = (a, b, point_in_a, n);
    Vec::new()
}
