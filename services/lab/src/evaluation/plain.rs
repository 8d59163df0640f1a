//! Common methods to triangulate keypoints of a network: plain triangulation, and triangulation that leaves out cameras.
//!
//! They are only compared with the 3D solution of the pipeline; the pipeline does not use them.

use geometry::Camera;
use nalgebra::{Matrix4, Point2, Point3};

/// A keypoint in a view: the camera, the position in pixels, and the score.
pub type Sighting<'a> = (&'a Camera, [f64; 2], f64);

/// Weighted linear triangulation (DLT; Hartley & Zisserman 2003, section 12.2) of undistorted, normalised keypoints.
///
/// * Returns `None` for fewer than two views, and for a point at infinity.
pub fn linear(views: &[Sighting<'_>]) -> Option<Point3<f64>> {
    if views.len() < 2 {
        return None;
    }
    let mut normal = Matrix4::<f64>::zeros();
    for (camera, pixel, weight) in views {
        let ideal = camera.undistorted_px(&Point2::from(*pixel))?;
        let at = camera.intrinsics.normalised(&ideal);
        let camera_from_world = camera.camera_from_world.to_homogeneous();
        for (row, value) in [(0, at.x), (1, at.y)] {
            let line = (camera_from_world.row(2) * value - camera_from_world.row(row)) * *weight;
            normal += line.transpose() * line;
        }
    }
    let solved = normal.symmetric_eigen();
    let point = solved.eigenvectors.column(solved.eigenvalues.imin()).into_owned();
    let point = Point3::new(point[0], point[1], point[2]) / point[3];
    point.iter().all(|value| value.is_finite()).then_some(point)
}

/// Linear triangulation that, like Pose2Sim, leaves out as few views as necessary for a mean reprojection error below `limit_px`. Among
/// sets of the same number of views, the set with the smallest error is used.
pub fn dropping(views: &[Sighting<'_>], limit_px: f64) -> Option<Point3<f64>> {
    let n = views.len().min(16);
    let mut best: Option<(f64, Point3<f64>)> = None;
    for kept in (2..=n).rev() {
        for mask in (0_u32..1 << n).filter(|i| i.count_ones() as usize == kept) {
            let chosen: Vec<Sighting<'_>> =
                (0..n).filter(|i| mask >> i & 1 == 1).map(|i| views[i]).collect();
            let Some(point) = linear(&chosen) else {
                continue;
            };
            let error = |(camera, pixel, _): &Sighting<'_>| {
                camera
                    .project(&point)
                    .map_or(f64::INFINITY, |at| (at.x - pixel[0]).hypot(at.y - pixel[1]))
            };
            let mean = chosen.iter().map(error).sum::<f64>() / kept as f64;
            if best.is_none_or(|best| mean < best.0) {
                best = Some((mean, point));
            }
        }
        if best.is_some_and(|best| best.0 < limit_px) {
            break;
        }
    }
    best.map(|best| best.1)
}

#[cfg(test)]
mod tests {
    use geometry::{Intrinsics, Lens};
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};

    use super::*;

    /// Returns a camera on a circle around the origin that points at the origin.
    fn camera(angle: f64) -> Camera {
        let eye = Point3::new(5.0 * angle.sin(), 0.0, 5.0 * angle.cos());
        Camera {
            name: "a camera".to_owned(),
            intrinsics: Intrinsics {
                fx: 900.0,
                fy: 900.0,
                cx: 320.0,
                cy: 240.0,
                size: [640, 480],
                lens: Lens::default(),
            },
            // nalgebra's cameras look along -z.
            camera_from_world: UnitQuaternion::from_axis_angle(
                &Vector3::x_axis(),
                core::f64::consts::PI,
            ) * Isometry3::look_at_rh(&eye, &Point3::origin(), &Vector3::y()),
        }
    }

    #[test]
    fn a_point_is_triangulated_and_a_wrong_view_is_left_out() {
        let cameras = [0.0, 0.7, 1.6, 2.9].map(camera);
        let truth = Point3::new(0.2, 0.3, -0.1);
        let mut views: Vec<Sighting<'_>> = cameras
            .iter()
            .map(|camera| {
                let at = camera.project(&truth).unwrap();
                (camera, [at.x, at.y], 1.0)
            })
            .collect();
        assert!((linear(&views).unwrap() - truth).norm() < 1e-9);
        assert_eq!(linear(&views[..1]), None);
        views[1].1[0] += 60.0;
        assert!((linear(&views).unwrap() - truth).norm() > 0.02);
        assert!((dropping(&views, 5.0).unwrap() - truth).norm() < 1e-9);
    }
}
