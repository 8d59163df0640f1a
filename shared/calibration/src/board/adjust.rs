//! Adjustment of all parameters at once, repeated without wrong corners.

use geometry::Camera;
use geometry::bundle::{Cameras, Free, Loss, Settings, solve};
use nalgebra::Point3;
use statistics::Sorted;

use super::outcome::{Adjusted, Shown, middle, outcome};
use super::problem::{BoardProblem, Observation};
use super::{BoardError, CornerLoss, Outcome, Task};

/// A corner is wrong if its residual exceeds both this number of standard deviations and a limit in pixels.
const WRONG_SIGMAS: f64 = 5.0;
const WRONG_PX: f64 = 0.7;
/// Median length of a residual, in standard deviations along an axis.
const RAYLEIGH_MEDIAN: f64 = 1.177_410;
/// Number of searches for wrong corners. Wrong corners stand out more clearly when the other corners fit better.
const ROUNDS: usize = 4;

/// Adjusts cameras and boards.
///
/// # Errors
///
/// Fails with [`BoardError::NotFinite`].
pub(crate) fn adjusted(
    task: &Task,
    cameras: Vec<Camera>,
    free: &[Free],
    boards: &[Shown],
) -> Result<Outcome, BoardError> {
    let all: Vec<Vec<(usize, Observation)>> =
        boards.iter().map(|board| observations(task, board)).collect();
    let seen: Vec<Vec<Observation>> =
        all.iter().map(|frame| frame.iter().map(|corner| corner.1).collect()).collect();
    let settings = Settings {
        max_iterations: 100,
        least_gain: 1e-9,
    };
    let start = BoardProblem {
        cameras: Cameras::new(cameras, free),
        boards: boards.iter().map(|board| board.world_from_board).collect(),
        seen: &seen,
        sigma_px: 1.0,
        loss: Loss::Cauchy(3.0),
    };
    let (mut places, _) = solve(start, &settings);
    let kept = without_wrong(&mut places, task.names.len(), &settings)?;
    let some = used(&seen, &kept);
    let solved = BoardProblem {
        seen: &some,
        loss: CornerLoss::FINAL,
        cameras: places.cameras,
        boards: places.boards,
        sigma_px: places.sigma_px.max(0.01),
    };
    Ok(outcome(
        task,
        &Adjusted {
            boards,
            all: &all,
            kept: &kept,
            solved: &solved,
        },
    ))
}

/// Adjusts repeatedly without the corners found to be wrong. Returns the corners that were used.
fn without_wrong(
    places: &mut BoardProblem<'_>,
    n_cameras: usize,
    settings: &Settings,
) -> Result<Vec<Vec<bool>>, BoardError> {
    let mut kept: Vec<Vec<bool>> = Vec::new();
    for _ in 0..ROUNDS {
        let limits = limits(places, n_cameras);
        let right = right(places, &limits);
        let is_same = right == kept;
        kept = right;
        if is_same {
            break;
        }
        let some = used(places.seen, &kept);
        let again = BoardProblem {
            seen: &some,
            sigma_px: sigma(&limits),
            loss: CornerLoss::FINAL,
            cameras: places.cameras.clone(),
            boards: places.boards.clone(),
        };
        let (better, report) = solve(again, settings);
        if !report.cost_after.is_finite() {
            return Err(BoardError::NotFinite);
        }
        places.sigma_px = better.sigma_px * report.variance().sqrt();
        places.cameras = better.cameras;
        places.boards = better.boards;
    }
    Ok(kept)
}

/// Returns the corners of a frame, with their numbers.
fn observations(task: &Task, board: &Shown) -> Vec<(usize, Observation)> {
    let centre = middle(task).translation.vector;
    let sights = board.sights.iter().zip(&board.spreads);
    let each = sights.flat_map(|(sight, spread)| {
        let points = sight.points.iter().zip(&sight.on_board);
        points.map(|((id, at), on_board)| {
            let on_board = Point3::new(on_board.x, on_board.y, 0.0) - centre;
            let camera = sight.camera;
            let seen = *at;
            (
                *id,
                Observation {
                    camera,
                    on_board,
                    seen,
                    spread: *spread,
                },
            )
        })
    });
    each.collect()
}

/// Returns the largest residual of a correct corner for each camera, in pixels.
fn limits(solved: &BoardProblem<'_>, n_cameras: usize) -> Vec<f64> {
    let mut lengths: Vec<Vec<f64>> = vec![Vec::new(); n_cameras];
    for (frame, seen) in solved.seen.iter().enumerate() {
        for (off, it) in solved.residuals(frame).into_iter().zip(seen) {
            lengths[it.camera].extend(off.map(|off| off.norm() / it.spread));
        }
    }
    let limit = |lengths: Vec<f64>| {
        let sigma = Sorted::new(lengths).median().unwrap_or(0.0) / RAYLEIGH_MEDIAN;
        (WRONG_SIGMAS * sigma).max(WRONG_PX)
    };
    lengths.into_iter().map(limit).collect()
}

/// For every corner of every frame, returns true if its residual is within the limits.
fn right(solved: &BoardProblem<'_>, limits: &[f64]) -> Vec<Vec<bool>> {
    let of_frame = |(frame, seen): (usize, &Vec<Observation>)| {
        let each = solved.residuals(frame).into_iter().zip(seen);
        each.map(|(off, it)| off.is_some_and(|off| off.norm() <= limits[it.camera] * it.spread))
            .collect()
    };
    solved.seen.iter().enumerate().map(of_frame).collect()
}

fn used(seen: &[Vec<Observation>], kept: &[Vec<bool>]) -> Vec<Vec<Observation>> {
    let of_frame = |(seen, kept): (&Vec<Observation>, &Vec<bool>)| {
        let used = seen.iter().zip(kept).filter(|corner| *corner.1);
        used.map(|used| *used.0).collect()
    };
    seen.iter().zip(kept).map(of_frame).collect()
}

fn sigma(limits: &[f64]) -> f64 {
    let sum: f64 = limits.iter().sum();
    (sum / (limits.len().max(1) as f64 * WRONG_SIGMAS)).max(0.02)
}
