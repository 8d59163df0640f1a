//! Pose of a flat board relative to one camera.

use crate::boards::Homography;
use geometry::{Camera, Intrinsics};
use nalgebra::{
    Isometry3, Matrix2x6, Matrix3, Point2, Point3, Rotation3, SMatrix, SVector, Translation3,
    UnitQuaternion, Vector3,
};

/// A point of a board (metres) and its position in a picture (pixels).
pub type Sighted = (Point2<f64>, Point2<f64>);

/// Number of steps of the refinement.
const STEPS: usize = 25;

/// Pose of a board relative to a camera, and the root mean square of its residuals in pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoardPose {
    pub(crate) camera_from_board: Isometry3<f64>,
    pub(crate) rms_px: f64,
}

/// Returns the pose of a board, from the projective map of its plane (Zhang 2000, section 3.1), then refined.
///
/// A small board may have a second possible pose, with its normal mirrored about the line of sight. The one with the smaller residuals is
/// returned. Returns `None` for fewer than four points, points on a line, or points that the lens cannot see.
pub(crate) fn board_pose(intrinsics: &Intrinsics, points: &[Sighted]) -> Option<BoardPose> {
    let start = linear(intrinsics, points)?;
    let first = refined(intrinsics, points, start);
    let second = refined(intrinsics, points, mirrored(&start, points));
    match (first, second) {
        (Some(a), Some(b)) => Some(if b.rms_px < a.rms_px { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// Returns the pose found by the linear method alone.
pub(crate) fn linear(intrinsics: &Intrinsics, points: &[Sighted]) -> Option<Isometry3<f64>> {
    let pairs = points.iter().filter_map(|(on_board, in_picture)| {
        let ideal = intrinsics.lens.undistort(&intrinsics.normalised(in_picture))?;
        Some((*on_board, ideal, 1.0))
    });
    let map = Homography::fit(pairs)?;
    let [a, b, t] = [0, 1, 2].map(|i| map.matrix().column(i).into_owned());
    let middle = points.iter().map(|point| point.0.coords);
    let middle = middle.sum::<nalgebra::Vector2<f64>>() / points.len() as f64;
    let depth = map.matrix().row(2) * Vector3::new(middle.x, middle.y, 1.0);
    let scale = depth[0].signum() * 2.0 / (a.norm() + b.norm());
    let rotation = nearest_rotation(&Matrix3::from_columns(&[
        a * scale,
        b * scale,
        a.cross(&b) * (scale * scale),
    ]))?;
    let translation = Translation3::from(t * scale);
    Some(Isometry3::from_parts(translation, rotation))
}

fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    if !matrix.iter().all(|value| value.is_finite()) {
        return None;
    }
    let svd = matrix.svd(true, true);
    let (u, vt) = (svd.u?, svd.v_t?);
    let sign = (u * vt).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * vt;
    let rotation = Rotation3::from_matrix_unchecked(rotation);
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Returns the second possible pose: the normal of the board is mirrored about the line of sight to its centre.
fn mirrored(pose: &Isometry3<f64>, points: &[Sighted]) -> Isometry3<f64> {
    let middle = points.iter().map(|point| point.0.coords);
    let middle = middle.sum::<nalgebra::Vector2<f64>>() / points.len() as f64;
    let on_board = Point3::new(middle.x, middle.y, 0.0);
    let in_camera = pose * on_board;
    let sight = in_camera.coords / in_camera.coords.norm().max(1e-12);
    let normal = pose.rotation * Vector3::z();
    let other = 2.0 * sight.dot(&normal) * sight - normal;
    let turn = UnitQuaternion::rotation_between(&normal, &other).unwrap_or_default();
    let rotation = turn * pose.rotation;
    let translation = in_camera.coords - rotation * on_board.coords;
    Isometry3::from_parts(Translation3::from(translation), rotation)
}

/// Minimises the squared residuals in pixels with the damped Gauss-Newton method.
pub(crate) fn refined(
    intrinsics: &Intrinsics,
    points: &[Sighted],
    start: Isometry3<f64>,
) -> Option<BoardPose> {
    let mut camera = Camera {
        name: String::new(),
        intrinsics: *intrinsics,
        camera_from_world: start,
    };
    let mut cost = square(&camera, points)?;
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let (normal, right) = equations(&camera, points)?;
        let damped = normal + SMatrix::from_diagonal(&(normal.diagonal() * damping));
        let step: SVector<f64, 6> = damped.cholesky()?.solve(&-right);
        let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        let shift: Vector3<f64> = step.fixed_rows::<3>(3).into_owned();
        let mut moved = camera.clone();
        moved.camera_from_world = Isometry3::from_parts(
            Translation3::from(camera.camera_from_world.translation.vector + shift),
            turn * camera.camera_from_world.rotation,
        );
        match square(&moved, points).filter(|value| *value < cost) {
            Some(less) => {
                let gain = cost - less;
                (camera, cost) = (moved, less);
                damping = (damping * 0.2).max(1e-9);
                if gain < 1e-9 * cost {
                    break;
                }
            }
            None if damping > 1e6 => break,
            None => damping *= 8.0,
        }
    }
    Some(BoardPose {
        camera_from_board: camera.camera_from_world,
        rms_px: (cost / points.len() as f64).sqrt(),
    })
}

/// Returns the sum of the squared residuals; `None` if a point has no image.
fn square(camera: &Camera, points: &[Sighted]) -> Option<f64> {
    points.iter().try_fold(0.0, |sum, (on_board, in_picture)| {
        let image = camera.project(&Point3::new(on_board.x, on_board.y, 0.0))?;
        Some(sum + (image - in_picture).norm_squared())
    })
}

fn equations(camera: &Camera, points: &[Sighted]) -> Option<(SMatrix<f64, 6, 6>, SVector<f64, 6>)> {
    let (mut normal, mut right) = (SMatrix::zeros(), SVector::zeros());
    let rotation = camera.camera_from_world.rotation;
    for (on_board, in_picture) in points {
        let on_board = Point3::new(on_board.x, on_board.y, 0.0);
        let (image, by_world) = camera.project_with_jacobian(&on_board)?;
        let by_camera = by_world * rotation.inverse().to_rotation_matrix().matrix();
        let turned = rotation * on_board.coords;
        let mut columns = Matrix2x6::zeros();
        for axis in 0..3 {
            let turn = by_camera * Vector3::ith(axis, 1.0).cross(&turned);
            columns.set_column(axis, &turn);
            columns.set_column(3 + axis, &by_camera.column(axis).into_owned());
        }
        normal += columns.transpose() * columns;
        right += columns.transpose() * (image - in_picture);
    }
    Some((normal, right))
}
