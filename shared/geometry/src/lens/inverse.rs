//! Inverse of a distortion: first the radius is found within a bracket, then the point is refined by Newton's method in the plane.

use nalgebra::{Point2, Vector2};

use super::{Lens, LensModel};

/// Largest residual of a successful inverse, in normalised coordinates; 2e-7 px at a focal length of 2000 px.
const TOLERANCE: f64 = 1e-10;

/// Inverts the distortion; see [`Lens::undistort`].
pub(super) fn undistort(lens: &Lens, distorted: &Point2<f64>) -> Option<Point2<f64>> {
    let target = distorted.coords;
    if !target.iter().all(|c| c.is_finite()) {
        return None;
    }
    if lens.model == LensModel::Pinhole {
        return (target.norm() <= lens.max_radius).then_some(*distorted);
    }
    let point = polish(lens, target, start(lens, target));
    let (reached, _) = lens.distort_with_jacobian(&point.into())?;
    let tolerance = TOLERANCE * (1.0 + target.norm());
    ((reached.coords - target).norm() <= tolerance).then_some(point.into())
}

/// Inverts the radial part, which is monotonic over the valid range, by Newton's method within a bracket.
fn start(lens: &Lens, target: Vector2<f64>) -> Vector2<f64> {
    let wanted = target.norm();
    if wanted < 1e-14 {
        return target;
    }
    let (mut low, mut high) = (0.0, lens.max_radius);
    let mut r = wanted.min(high);
    for _ in 0..100 {
        let (reached, slope) = lens.model.radius(r);
        if reached < wanted {
            low = r;
        } else {
            high = r;
        }
        let newton = r - (reached - wanted) / slope;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        if (next - r).abs() <= 1e-15 * (1.0 + r) {
            break;
        }
        r = next;
    }
    target * (r / wanted)
}

/// Takes Newton steps while they reduce the residual; steps that overshoot are halved.
fn polish(lens: &Lens, target: Vector2<f64>, mut point: Vector2<f64>) -> Vector2<f64> {
    let (mut reached, mut jacobian) = lens.model.distort(point);
    for _ in 0..30 {
        let residual = reached - target;
        let Some(step) = jacobian.try_inverse().map(|inverse| inverse * residual) else {
            break;
        };
        let mut scale = 1.0;
        let better = loop {
            let candidate = point - step * scale;
            if candidate == point {
                break None;
            }
            let (at, slope) = lens.model.distort(candidate);
            if (at - target).norm() < residual.norm() {
                break Some((candidate, at, slope));
            }
            scale *= 0.5;
            if scale < 1e-3 {
                break None;
            }
        };
        let Some(better) = better else { break };
        (point, reached, jacobian) = better;
    }
    point
}
