//! Refinement: minimum of the robust reprojection error, by the Levenberg-Marquardt method.

use nalgebra::{Matrix3, Point3, Vector3};

use super::{
    TriangulateError,
    views::{Subset, Views},
};

/// Maximum number of steps to try for one width of the loss.
const MAX_ITERATIONS: usize = 100;

/// A refined point.
pub(super) struct Fit {
    pub(super) in_world: Point3<f64>,
    /// Normal matrix `Σ ρ' Jᵀ J / σ²`.
    pub(super) normal: Matrix3<f64>,
    pub(super) rms_px: f64,
    pub(super) worst_px: f64,
    pub(super) iterations: usize,
}

/// Objective at a point: its value, gradient, normal matrix and plain errors.
struct Objective {
    cost: f64,
    gradient: Vector3<f64>,
    normal: Matrix3<f64>,
    rms_px: f64,
    worst_px: f64,
}

/// Refines `start` with a loss whose width decreases from the worst initial error to `loss_px`.
pub(super) fn refine(
    views: &Views<'_>,
    used: Subset,
    start: Point3<f64>,
    loss_px: f64,
) -> Result<Fit, TriangulateError> {
    let mut point = start;
    let mut iterations = 0;
    let mut loss = loss_px.max(evaluate(views, used, &start, f64::INFINITY)?.worst_px);
    loop {
        iterations += descend(views, used, &mut point, loss)?;
        if loss <= loss_px {
            break;
        }
        loss = (0.5 * loss).max(loss_px);
    }
    let Objective {
        normal,
        rms_px,
        worst_px,
        cost,
        ..
    } = evaluate(views, used, &point, loss_px)?;
    if !cost.is_finite() {
        return Err(TriangulateError::Diverged { iterations });
    }
    Ok(Fit {
        in_world: point,
        normal,
        rms_px,
        worst_px,
        iterations,
    })
}

/// Minimises from `point` until steps no longer lower the cost. Returns the number of steps tried.
fn descend(
    views: &Views<'_>,
    used: Subset,
    point: &mut Point3<f64>,
    loss_px: f64,
) -> Result<usize, TriangulateError> {
    let mut here = evaluate(views, used, point, loss_px)?;
    let mut damping = 1e-3;
    for iteration in 0..MAX_ITERATIONS {
        let mut damped = here.normal;
        for i in 0..3 {
            damped[(i, i)] *= 1.0 + damping;
        }
        let Some(factor) = damped.cholesky() else {
            return Err(TriangulateError::Diverged {
                iterations: iteration,
            });
        };
        let step = factor.solve(&here.gradient);
        let candidate = *point - step;
        // A step to a point behind a camera, or outside the range of its lens, is rejected.
        match evaluate(views, used, &candidate, loss_px) {
            Ok(there) if there.cost < here.cost => {
                *point = candidate;
                here = there;
                damping = (damping * 0.1).max(1e-12);
            }
            _ => damping *= 10.0,
        }
        if step.norm() <= 1e-13 * (1.0 + point.coords.norm()) || damping > 1e9 {
            return Ok(iteration + 1);
        }
    }
    Ok(MAX_ITERATIONS)
}

fn evaluate(
    views: &Views<'_>,
    used: Subset,
    point: &Point3<f64>,
    loss_px: f64,
) -> Result<Objective, TriangulateError> {
    let mut sum = Objective {
        cost: 0.0,
        gradient: Vector3::zeros(),
        normal: Matrix3::zeros(),
        rms_px: 0.0,
        worst_px: 0.0,
    };
    let mut squares = 0.0;
    for (view, seen, _) in views.iter(used) {
        let Some((image, jacobian)) = seen.camera.project_with_jacobian(point) else {
            let behind = (seen.camera.camera_from_world * point).z <= 0.0;
            return Err(if behind {
                TriangulateError::BehindCamera { view }
            } else {
                TriangulateError::OutsideLens { view }
            });
        };
        let error = image - seen.point_px;
        let square = error.norm_squared();
        let (value, slope) = cauchy(square, loss_px);
        let precision = 1.0 / (seen.sigma_px * seen.sigma_px);
        sum.cost += precision * value;
        sum.gradient += jacobian.transpose() * error * (precision * slope);
        sum.normal += jacobian.transpose() * jacobian * (precision * slope);
        sum.worst_px = sum.worst_px.max(square.sqrt());
        squares += square;
    }
    sum.rms_px = (squares / used.count() as f64).sqrt();
    Ok(sum)
}

/// Returns the Cauchy loss of a squared error and its derivative; an infinite width gives plain squares.
fn cauchy(square: f64, width: f64) -> (f64, f64) {
    if width.is_infinite() {
        return (square, 1.0);
    }
    let ratio = square / (width * width);
    (width * width * ratio.ln_1p(), 1.0 / (1.0 + ratio))
}
