//! Pose of a board that does not move, seen by cameras with known poses.

use geometry::Camera;
use geometry::bundle::{Cameras, Free, Loss, Settings, solve};
use nalgebra::{Isometry3, Point2, Point3};

use super::pose::board_pose;
use super::problem::{BoardProblem, Observation};
use super::{LEAST_CORNERS, Sight};

/// Returns the pose of a board in the world, and the root mean square of its residuals in pixels. Returns `None` if no camera sees enough
/// of the board.
///
/// * `sights`: sights of all cameras in one or more frames; the board has the same pose in all of them.
pub fn standing_board(
    cameras: &[Camera],
    board: &[Point2<f64>],
    sights: &[Sight],
) -> Option<(Isometry3<f64>, f64)> {
    let enough: Vec<&Sight> =
        sights.iter().filter(|sight| sight.points.len() >= LEAST_CORNERS).collect();
    let seen: Vec<Observation> = enough
        .iter()
        .flat_map(|sight| {
            sight.points.iter().map(|(id, at)| Observation {
                camera: sight.camera,
                on_board: Point3::new(board[*id].x, board[*id].y, 0.0),
                seen: *at,
                spread: 1.0,
            })
        })
        .collect();
    let seen = vec![seen];
    let candidates = enough.iter().filter_map(|sight| {
        let camera = &cameras[sight.camera];
        let pose = board_pose(&camera.intrinsics, &sight.sighted())?;
        let start = camera.camera_from_world.inverse() * pose.camera_from_board;
        let problem = BoardProblem {
            cameras: Cameras::new(cameras.to_vec(), &vec![Free::default(); cameras.len()]),
            boards: vec![start],
            seen: &seen,
            sigma_px: 1.0,
            loss: Loss::Huber(3.0),
        };
        let (solved, _) = solve(problem, &Settings::default());
        let residuals = solved.residuals(0);
        let squares =
            residuals.iter().map(|residual| residual.map_or(1e6, |off| off.norm_squared()));
        let rms_px = (squares.sum::<f64>() / residuals.len().max(1) as f64).sqrt();
        Some((solved.boards[0], rms_px))
    });
    candidates.min_by(|a, b| a.1.total_cmp(&b.1))
}
