//! Radius up to which a distortion model is monotonic.

use super::LensModel;

/// Tangent of the largest angle to the axis that a lens accepts, 87 degrees.
const WIDEST: f64 = 19.0;

/// Number of steps of the scan for the first turning point; the last step is bisected.
const STEPS: u32 = 1900;

/// Returns the largest undistorted radius up to which the distorted radius increases.
pub(super) fn max_radius(model: &LensModel) -> f64 {
    let mut inside = 0.0;
    for i in 1..=STEPS {
        let outside = WIDEST * f64::from(i) / f64::from(STEPS);
        if !grows(model, inside, outside) {
            return turning_point(model, inside, outside);
        }
        inside = outside;
    }
    WIDEST
}

/// Returns true if the distorted radius is finite, positive and increasing at `r`, and above its value at `before`.
fn grows(model: &LensModel, before: f64, r: f64) -> bool {
    let (distorted, slope) = model.radius(r);
    slope > 0.0 && distorted.is_finite() && distorted > model.radius(before).0
}

fn turning_point(model: &LensModel, mut inside: f64, mut outside: f64) -> f64 {
    let start = inside;
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if grows(model, start, middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}
