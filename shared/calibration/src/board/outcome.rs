//! Result of an adjustment for every camera.

use geometry::Camera;
use geometry::bundle::{Problem as _, clustered, covariance};
use nalgebra::{Isometry3, Point2, Translation3, Vector3};

use super::problem::{BoardProblem, Observation};
use super::{CameraOutcome, Known, Outcome, Residual, Sight, Task, choose};

/// Maximum number of parts into which a recording is divided for comparison.
const MOST_PARTS: usize = 10;

/// A frame that is used.
pub(crate) struct Shown {
    pub(crate) frame: usize,
    /// Pose of the board; its origin is the centre of the board.
    pub(crate) world_from_board: Isometry3<f64>,
    pub(crate) sights: Vec<Sight>,
    /// Spread of each sight; see [`Observation::spread`].
    pub(crate) spreads: Vec<f64>,
}

/// Returns the coordinate system of the board with its origin at the centre of the board.
pub(crate) fn middle(task: &Task) -> Isometry3<f64> {
    let n = task.board.len().max(1) as f64;
    let sum = task.board.iter().map(|board| board.coords);
    let sum = sum.sum::<nalgebra::Vector2<f64>>();
    Translation3::new(sum.x / n, sum.y / n, 0.0).into()
}

/// State at the end of the adjustment.
pub(crate) struct Adjusted<'a> {
    pub(crate) boards: &'a [Shown],
    /// Every corner of every frame, with its number.
    pub(crate) all: &'a [Vec<(usize, Observation)>],
    /// True for corners that were used.
    pub(crate) kept: &'a [Vec<bool>],
    /// The problem solved with the corners that were used.
    pub(crate) solved: &'a BoardProblem<'a>,
}

/// Returns the outcome, without pairs and doubts.
pub(crate) fn outcome(task: &Task, adjusted: &Adjusted<'_>) -> Outcome {
    let Adjusted {
        boards,
        all,
        kept,
        solved,
    } = adjusted;
    let n_cameras = task.names.len();
    let mut residuals: Vec<Vec<Residual>> = vec![Vec::new(); n_cameras];
    let mut frames: Vec<Vec<usize>> = vec![Vec::new(); n_cameras];
    for (nth, board) in boards.iter().enumerate() {
        for ((id, it), is_kept) in all[nth].iter().zip(&kept[nth]) {
            let camera = &solved.cameras.cameras()[it.camera];
            let image = camera.project(&(solved.boards[nth] * it.on_board));
            frames[it.camera].push(board.frame);
            residuals[it.camera].push(Residual {
                frame: board.frame,
                id: *id,
                at: it.seen,
                off: image.map_or_else(|| nalgebra::Vector2::repeat(1e3), |image| image - it.seen),
                is_wrong: !is_kept,
            });
        }
    }
    let known = numbers(solved);
    let cameras = residuals.into_iter().enumerate().map(|(nth, residuals)| {
        frames[nth].dedup();
        let used = |residual: &&Residual| !residual.is_wrong;
        let place = |residual: &Residual| -> Point2<f64> { residual.at };
        CameraOutcome {
            camera: solved.cameras.cameras()[nth].clone(),
            is_known: task.known[nth].is_some(),
            n_boards: [0, frames[nth].len()],
            rms_px: rms(residuals.iter().filter(used).map(|residual| residual.off)),
            rms_of_all_px: rms(residuals.iter().map(|residual| residual.off)),
            coverage: choose::coverage(residuals.iter().filter(used).map(place), task.sizes[nth]),
            numbers: known[solved.cameras.parameters(nth)].to_vec(),
            residuals,
        }
    });
    let back = middle(task).inverse();
    let placed = boards.iter().zip(&solved.boards);
    Outcome {
        cameras: cameras.collect(),
        pairs: Vec::new(),
        boards: placed.map(|(board, pose)| (board.frame, pose * back)).collect(),
        sigma_px: solved.sigma_px,
        out_of_step: None,
        doubts: Vec::new(),
    }
}

fn rms(off: impl Iterator<Item = nalgebra::Vector2<f64>>) -> f64 {
    let squares: Vec<f64> = off.map(|off| off.norm_squared()).collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Returns every free parameter with its standard deviation, which is infinite if the pictures do not determine the parameter.
///
/// It is the larger of two estimates. The first assumes that the errors of corners are independent. The second is computed from the
/// differences between parts of the recording. It therefore also covers errors that are common to successive frames: a moving board is
/// blurred, scanned row by row, and in a different position in the next camera's picture.
fn numbers(solved: &BoardProblem<'_>) -> Vec<Known> {
    let spread = covariance(solved).ok();
    let n_parts = solved.boards.len().min(MOST_PARTS);
    let parts: Vec<usize> = (0..solved.boards.len())
        .map(|nth| nth * n_parts / solved.boards.len())
        .collect();
    let by_parts = clustered(solved, &parts).ok().flatten();
    let cameras = solved.cameras.cameras();
    let owner = |parameter: usize| {
        (0..cameras.len()).find(|nth| solved.cameras.parameters(*nth).contains(&parameter))
    };
    (0..solved.n_shared())
        .map(|parameter| {
            let full = solved.name(parameter);
            let name = full.rsplit(": ").next().unwrap_or_default().to_owned();
            let value = owner(parameter).map_or(f64::NAN, |nth| value_of(&cameras[nth], &name));
            let is_turn = name.starts_with("rotation");
            let unit = if is_turn {
                180.0 / core::f64::consts::PI
            } else {
                1.0
            };
            let sd = spread.as_ref().map_or(f64::INFINITY, |spread| spread.sd(parameter));
            let sd = by_parts.as_ref().map_or(sd, |part| sd.max(part.sd(parameter)));
            Known {
                name,
                value: value * unit,
                sd: sd * unit,
            }
        })
        .collect()
}

fn value_of(camera: &Camera, name: &str) -> f64 {
    let intrinsics = &camera.intrinsics;
    let axis = |vector: Vector3<f64>| match name.chars().last() {
        Some('x') => vector.x,
        Some('y') => vector.y,
        _ => vector.z,
    };
    match name {
        "focal length" => intrinsics.fx,
        "focal length y" => intrinsics.fy,
        "principal point x" => intrinsics.cx,
        "principal point y" => intrinsics.cy,
        _ if name.starts_with("rotation") => axis(camera.camera_from_world.rotation.scaled_axis()),
        _ if name.starts_with("place") => axis(camera.centre_in_world().coords),
        _ => {
            let names = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"];
            let short = name.trim_start_matches("lens ");
            let nth = names.iter().position(|name| *name == short);
            let value = nth.and_then(|nth| intrinsics.lens.model().coefficients().nth(nth));
            value.unwrap_or(f64::NAN)
        }
    }
}
