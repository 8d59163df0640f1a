//! Linear initial solution: the point that satisfies the projection equations best.

use nalgebra::{Matrix3, Point3, Vector3};

use super::{
    TriangulateError,
    views::{Subset, Views},
};

/// Solves `(x r₃ - r₁) · X = t₁ - x t₃` and the same for y, over all views together, for a finite point.
///
/// This is the direct linear transform with the point's last coordinate set to 1 (Hartley & Sturm 1997, "Linear-LS"), so that the result
/// does not depend on the origin of the world. The second round divides every equation by the depth and multiplies it by f / σ, to get
/// pixels instead of metres. The point may be behind a camera; the refinement refuses that.
pub(super) fn triangulate(
    views: &Views<'_>,
    used: Subset,
    min_angle: f64,
) -> Result<Point3<f64>, TriangulateError> {
    let angle = widest_angle(views, used);
    if angle < min_angle {
        return Err(TriangulateError::ParallelRays {
            angle,
            limit: min_angle,
        });
    }
    let parallel = TriangulateError::ParallelRays {
        angle,
        limit: min_angle,
    };
    let rough = solve(views, used, None).ok_or(parallel)?;
    Ok(solve(views, used, Some(&rough)).unwrap_or(rough))
}

/// Returns the widest angle between two viewing rays, in radians in [0, π].
fn widest_angle(views: &Views<'_>, used: Subset) -> f64 {
    let direction = |view: usize| {
        let (_, seen, normalised) = views.iter(used).find(|&(v, _, _)| v == view)?;
        let in_camera = normalised.coords.push(1.0);
        Some(seen.camera.camera_from_world.rotation.inverse() * in_camera)
    };
    let mut widest = 0.0;
    for a in used.iter() {
        for b in used.iter().take_while(|&b| b < a) {
            if let (Some(a), Some(b)) = (direction(a), direction(b)) {
                // The angle or its supplement is used, whichever is smaller, because opposite rays determine the depth as little as equal
                // ones.
                widest = a.cross(&b).norm().atan2(a.dot(&b).abs()).max(widest);
            }
        }
    }
    widest
}

fn solve(views: &Views<'_>, used: Subset, near: Option<&Point3<f64>>) -> Option<Point3<f64>> {
    let origin = views.iter(used).next()?.1.camera.centre_in_world();
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (_, seen, normalised) in views.iter(used) {
        let pose = &seen.camera.camera_from_world;
        let weight = near.map_or(1.0, |point| {
            let focal = (seen.camera.intrinsics.fx * seen.camera.intrinsics.fy).sqrt();
            focal / (seen.sigma_px * (pose * point).z.abs().max(1e-6))
        });
        let rotation = pose.rotation.to_rotation_matrix();
        let [r1, r2, r3] = [0, 1, 2].map(|r| rotation.matrix().row(r).transpose());
        let at_origin = pose * origin;
        for (coordinate, row, offset) in [
            (normalised.x, r1, at_origin.x),
            (normalised.y, r2, at_origin.y),
        ] {
            let row = (r3 * coordinate - row) * weight;
            normal += row * row.transpose();
            right += row * (weight * (offset - coordinate * at_origin.z));
        }
    }
    let solution = origin + normal.cholesky()?.solve(&right);
    solution.coords.iter().all(|c| c.is_finite()).then_some(solution)
}
