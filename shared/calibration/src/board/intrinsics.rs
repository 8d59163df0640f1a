//! Intrinsics of one camera from boards, without prior knowledge.

use geometry::bundle::{Cameras, Free, Loss, Settings, solve};
use geometry::{Camera, Intrinsics, Lens, LensModel};
use nalgebra::{Isometry3, Point3};

use super::pose::{Sighted, board_pose, linear};
use super::problem::{BoardProblem, Observation};
use super::{CornerLoss, LensKind};

/// Shortest focal length that is tried, as a fraction of the longer side of the picture. Each further focal length is larger by a constant
/// factor.
const SHORTEST: f64 = 0.25;
const FACTOR: f64 = 1.12;
const TRIED: i32 = 26;
/// Maximum number of boards for the initial estimate.
const FIRST_LOOK: usize = 25;

/// Returns an initial estimate: the focal length with which the boards fit best, without distortion.
pub(crate) fn start(size: [u32; 2], lens: LensKind, boards: &[Vec<Sighted>]) -> Option<Intrinsics> {
    let longer = f64::from(size[0].max(size[1]));
    let step = boards.len().div_ceil(FIRST_LOOK).max(1);
    let tried = (0..TRIED).map(|nth| with_focal(size, lens, longer * SHORTEST * FACTOR.powi(nth)));
    let cost = |intrinsics: &Intrinsics| -> f64 {
        let each = boards.iter().step_by(step).map(|points| {
            let rms = linear(intrinsics, points).and_then(|pose| square(intrinsics, &pose, points));
            rms.map_or(1e4, |rm| rm.min(1e4))
        });
        each.sum()
    };
    let costs: Vec<(f64, Intrinsics)> = tried.map(|tried| (cost(&tried), tried)).collect();
    let best = costs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    best.0.is_finite().then_some(best.1)
}

fn with_focal(size: [u32; 2], lens: LensKind, focal: f64) -> Intrinsics {
    Intrinsics {
        fx: focal,
        fy: focal,
        cx: 0.5 * f64::from(size[0] - 1),
        cy: 0.5 * f64::from(size[1] - 1),
        size,
        lens: Lens::new(match lens {
            LensKind::Fisheye => LensModel::KannalaBrandt { k: [0.0; 4] },
            LensKind::Five | LensKind::Eight => LensModel::BrownConrady {
                k: [0.0; 6],
                p: [0.0; 2],
            },
        }),
    }
}

/// Returns the mean square of the residuals of a pose, in square pixels.
fn square(intrinsics: &Intrinsics, pose: &Isometry3<f64>, points: &[Sighted]) -> Option<f64> {
    let camera = Camera {
        name: String::new(),
        intrinsics: *intrinsics,
        camera_from_world: *pose,
    };
    let sum = points.iter().try_fold(0.0, |sum, (on_board, seen)| {
        let image = camera.project(&Point3::new(on_board.x, on_board.y, 0.0))?;
        Some(sum + (image - seen).norm_squared())
    });
    sum.map(|sum| sum / points.len().max(1) as f64)
}

/// Returns the parameters of a camera that are free.
pub(crate) fn free(lens: LensKind, pose: bool) -> Free {
    Free {
        pose,
        focal: true,
        aspect: true,
        centre: true,
        lens: match lens {
            LensKind::Five => [true, true, true, false, false, false, true, true],
            LensKind::Eight => [true; 8],
            LensKind::Fisheye => [true, true, true, true, false, false, false, false],
        },
    }
}

/// Returns the intrinsics from boards: the result of [`start`], adjusted step by step with the poses of the boards.
///
/// First the focal length is adjusted, then also the first coefficient of the lens, then everything. Without these steps, a strongly
/// distorted lens may end at a wrong minimum.
pub(crate) fn adjusted(
    start: Intrinsics,
    lens: LensKind,
    boards: &[Vec<Sighted>],
) -> Option<Intrinsics> {
    let all = free(lens, false);
    let mut only_focal = all;
    (only_focal.aspect, only_focal.centre, only_focal.lens) = (false, false, [false; 8]);
    let mut bent = only_focal;
    bent.lens[0] = true;
    bent.lens[1] = true;
    let mut intrinsics = start;
    for (free, loss) in [
        (only_focal, Loss::Cauchy(8.0)),
        (bent, Loss::Cauchy(4.0)),
        (all, Loss::Cauchy(2.0)),
        (all, CornerLoss::ROBUST),
    ] {
        intrinsics = adjusted_once(&intrinsics, free, loss, boards)?;
    }
    Some(intrinsics)
}

fn adjusted_once(
    intrinsics: &Intrinsics,
    free: Free,
    loss: Loss,
    boards: &[Vec<Sighted>],
) -> Option<Intrinsics> {
    let camera = Camera {
        name: "camera".to_owned(),
        intrinsics: *intrinsics,
        camera_from_world: Isometry3::identity(),
    };
    let (mut poses, mut seen) = (Vec::new(), Vec::new());
    for points in boards {
        let Some(pose) = board_pose(intrinsics, points) else {
            continue;
        };
        poses.push(pose.camera_from_board);
        let each = points.iter().map(|(on_board, at)| Observation {
            camera: 0,
            on_board: Point3::new(on_board.x, on_board.y, 0.0),
            seen: *at,
            spread: 1.0,
        });
        seen.push(each.collect());
    }
    if poses.is_empty() {
        return None;
    }
    let problem = BoardProblem {
        cameras: Cameras::new(vec![camera], &[free]),
        boards: poses,
        seen: &seen,
        sigma_px: 1.0,
        loss,
    };
    let settings = Settings {
        max_iterations: 60,
        least_gain: 1e-8,
    };
    let (solved, report) = solve(problem, &settings);
    let answer = solved.cameras.cameras()[0].intrinsics;
    (report.cost_after.is_finite() && answer.fx > 0.0 && answer.fy > 0.0).then_some(answer)
}
