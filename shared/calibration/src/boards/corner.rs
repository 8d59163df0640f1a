//! Sub-pixel position of a corner.

use nalgebra::{Matrix2, Point2, Vector2};

use crate::boards::Picture;

/// Maximum number of iterations, and the step in pixels that ends them.
const MOST_STEPS: usize = 30;
const LAST_STEP: f64 = 1e-3;

/// Returns the corner near `start` (Förstner & Gülch 1987; `cornerSubPix` in `OpenCV`). It is the point q that minimises the weighted sum
/// of (g · (p - q))², where g is the gradient of the picture at a nearby point p.
///
/// * `radius`: half the side of the window, in pixels. The weight is a Gaussian whose standard deviation is 0.7 times the radius.
///
/// Returns `None` if all gradients have the same direction (an edge), or if the corner is not within `radius` of `start`.
pub(crate) fn refine(picture: &Picture, start: Point2<f64>, radius: f64) -> Option<Point2<f64>> {
    let steps = radius.ceil() as i32;
    let mut at = start;
    for _ in 0..MOST_STEPS {
        if !picture.holds(at, 2.0) {
            return None;
        }
        let mut normal = Matrix2::zeros();
        let mut right = Vector2::zeros();
        for dy in -steps..=steps {
            for dx in -steps..=steps {
                let offset =
                    Vector2::new(f64::from(dx), f64::from(dy)) * (radius / f64::from(steps));
                let weight = (-offset.norm_squared() / (0.98 * radius * radius)).exp();
                let slope = picture.slope(at + offset);
                let outer = weight * slope * slope.transpose();
                normal += outer;
                right += outer * offset;
            }
        }
        let trace = normal.trace();
        // Ratio of the smaller eigenvalue to the larger; it is 0 for an edge.
        let sharpness = normal.determinant();
        if sharpness.is_nan() || sharpness <= 0.02 * trace * trace / 4.0 {
            return None;
        }
        let step = normal.try_inverse()? * right;
        at += step;
        let moved = (at - start).norm();
        if moved.is_nan() || moved > radius {
            return None;
        }
        if step.norm() < LAST_STEP {
            break;
        }
    }
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blurred_corner_is_found_to_a_hundredth_of_a_pixel() {
        let truth = Point2::new(20.37, 19.81);
        let soft = |value: f64| (value / 1.2).tanh();
        let pixels = (0..40 * 40).map(|i| {
            let offset = Point2::new(f64::from(i % 40), f64::from(i / 40)) - truth;
            let (u, v) = (offset.x + 0.2 * offset.y, offset.y - 0.3 * offset.x);
            (128.0 + 80.0 * soft(u) * soft(v)) as u8
        });
        let picture = Picture::new(40, 40, pixels.collect()).unwrap();
        let found = refine(&picture, Point2::new(21.0, 19.0), 5.0).unwrap();
        assert!((found - truth).norm() < 0.03, "{found}");
    }

    #[test]
    fn an_edge_and_a_plain_picture_have_no_corner() {
        let edge = (0..40 * 40).map(|i| if i % 40 < 20 { 20 } else { 220 });
        let picture = Picture::new(40, 40, edge.collect()).unwrap();
        assert_eq!(refine(&picture, Point2::new(20.0, 20.0), 5.0), None);
        let plain = Picture::new(40, 40, vec![100; 1600]).unwrap();
        assert_eq!(refine(&plain, Point2::new(20.0, 20.0), 5.0), None);
    }
}
