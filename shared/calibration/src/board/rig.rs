//! Calibration of cameras from sights of a board.

use geometry::bundle::Free;
use geometry::{Camera, Intrinsics};
use nalgebra::{Isometry3, Point3};

use super::adjust::adjusted;
use super::graph::{Meeting, Pair, pair, standing};
use super::outcome::{Shown, middle};
use super::pose::board_pose;
use super::{
    BoardError, CameraOutcome, LEAST_BOARDS, LEAST_CORNERS, LensKind, OutOfStep, Outcome, Sight,
    Task, Together, certainty, choose, intrinsics, verdict,
};

/// Maximum number of pictures for the initial intrinsics of one camera.
const MOST_FOR_START: usize = 60;
/// Cameras are out of step if fitting all of them together gives residuals that are larger by this factor than fitting each camera alone,
/// and that also exceed a limit in pixels.
const OUT_OF_STEP: f64 = 1.4;
const OUT_OF_STEP_PX: f64 = 0.4;

/// Calibrates cameras from a board.
///
/// The world is the coordinate system of the first camera; its up direction is unknown.
///
/// # Errors
///
/// Fails with [`BoardError`] if there is no result. A result that should not be trusted has [`Outcome::doubts`].
pub fn calibrate(task: &Task) -> Result<Outcome, BoardError> {
    let usable = |sight: &&Sight| sight.points.len() >= LEAST_CORNERS && verdict::is_spread(sight);
    let sights: Vec<Sight> = task.sights.iter().filter(usable).cloned().collect();
    let mut started = Vec::new();
    for camera in 0..task.names.len() {
        started.push(first_intrinsics(task, camera, &sights)?);
    }
    if !task.wants_rig {
        return each_alone(task, &sights, &started);
    }
    let alone = each_alone(task, &sights, &started)?;
    let lenses: Vec<Intrinsics> =
        alone.cameras.iter().map(|camera| camera.camera.intrinsics).collect();
    let placed = placed(task, &sights, &lenses);
    let (pairs, together) = pairs(task, &placed);
    let standing = standing(task.names.len(), &pairs);
    let poses: Option<Vec<Isometry3<f64>>> = standing.poses.iter().copied().collect();
    let Some(poses) = poses else {
        let named =
            |group: &Vec<usize>| group.iter().map(|group| task.names[*group].clone()).collect();
        return Err(BoardError::Apart {
            groups: standing.groups.iter().map(named).collect(),
        });
    };
    let cameras: Vec<Camera> = (0..task.names.len())
        .map(|nth| camera_of(task, nth, lenses[nth], poses[nth]))
        .collect();
    let free: Vec<Free> = (0..cameras.len()).map(|nth| free_of(task, nth, nth != 0)).collect();
    let frames = choose::frames(&sights, &task.sizes, task.most_frames);
    let found = boards(task, &cameras, &placed, &frames);
    let mut outcome = adjusted(task, cameras.clone(), &free, &found)?;
    if let Some(told) = out_of_step(&alone, &outcome) {
        outcome = in_step(task, (cameras, &alone), &placed, &sights)?;
        outcome.out_of_step = Some(told);
    }
    outcome.pairs = together;
    for (nth, camera) in outcome.cameras.iter_mut().enumerate() {
        camera.n_boards[0] = sights.iter().filter(|sight| sight.camera == nth).count();
    }
    verdict::doubt(task, &mut outcome);
    Ok(outcome)
}

/// Returns evidence that the cameras fit worse together than each one alone. The evidence is either larger residuals or changed lenses: if
/// only a few frames show the board in several cameras, the adjustment changes the lenses to keep the residuals small.
fn out_of_step(alone: &Outcome, together: &Outcome) -> Option<OutOfStep> {
    let [alone_px, together_px] = [alone, together].map(pooled);
    let is_worse = together_px > OUT_OF_STEP * alone_px && together_px > OUT_OF_STEP_PX;
    let focal = |outcome: &Outcome, nth: usize| outcome.cameras[nth].camera.intrinsics.fx;
    let bent = (0..alone.cameras.len())
        .map(|nth| (focal(together, nth) / focal(alone, nth) - 1.0).abs())
        .fold(0.0, f64::max);
    let is_bent = !verdict::are_lenses_the_same(together, alone);
    (is_worse || is_bent).then_some(OutOfStep {
        alone_px,
        together_px,
        bent,
    })
}

/// Finds the poses of cameras whose pictures of one frame were not taken at the same time. Such pictures give wrong poses of the board, and
/// an adjustment of everything would change the lenses to fit them. The lens of each camera is therefore found with board poses of its own,
/// as if the camera were alone. For the poses of the cameras, a picture of a faster board has a lower weight.
fn in_step(
    task: &Task,
    (cameras, alone): (Vec<Camera>, &Outcome),
    placed: &[Placed],
    sights: &[Sight],
) -> Result<Outcome, BoardError> {
    let speeds = choose::speeds(sights, task.names.len());
    let slow = choose::slow(sights, &speeds, task.most_frames);
    let frames = choose::frames(&slow, &task.sizes, task.most_frames);
    let mut shown = boards(task, &cameras, placed, &frames);
    for board in &mut shown {
        for (sight, spread) in board.sights.iter().zip(&mut board.spreads) {
            *spread = certainty::spread(sight, &speeds, alone.sigma_px);
        }
    }
    for nth in (0..cameras.len()).filter(|nth| task.known[*nth].is_none()) {
        let (own, own_placed) = own(nth, sights, placed);
        let frames = choose::frames(&own, &task.sizes, task.most_frames);
        shown.extend(boards(task, &cameras, &own_placed, &frames));
    }
    shown.sort_by_key(|board| board.frame);
    let free: Vec<Free> = (0..cameras.len()).map(|nth| free_of(task, nth, nth != 0)).collect();
    let mut outcome = adjusted(task, cameras, &free, &shown)?;
    // Keep one board per frame, and each camera's corners once. The residuals come from the fit of each camera alone, because the other
    // cameras took their pictures at other times.
    outcome.boards.dedup_by_key(|(frame, _)| *frame);
    for (camera, alone) in outcome.cameras.iter_mut().zip(&alone.cameras) {
        *camera = CameraOutcome {
            camera: camera.camera.clone(),
            numbers: core::mem::take(&mut camera.numbers),
            ..alone.clone()
        };
    }
    Ok(outcome)
}

/// Returns the sights of one camera, and its sights with a known board pose.
fn own(nth: usize, sights: &[Sight], placed: &[Placed]) -> (Vec<Sight>, Vec<Placed>) {
    let sights = sights.iter().filter(|sight| sight.camera == nth);
    let placed = placed.iter().filter(|placed| placed.sight.camera == nth);
    (sights.cloned().collect(), placed.cloned().collect())
}

/// Returns the root mean square of all residuals that were used, in pixels.
fn pooled(outcome: &Outcome) -> f64 {
    let all = outcome.cameras.iter().flat_map(|camera| &camera.residuals);
    let squares: Vec<f64> = all
        .filter(|residual| !residual.is_wrong)
        .map(|residual| residual.off.norm_squared())
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

fn free_of(task: &Task, camera: usize, pose: bool) -> Free {
    match task.known[camera] {
        Some(_) if pose => Free::POSE,
        Some(_) => Free::default(),
        None => intrinsics::free(task.lens, pose),
    }
}

fn camera_of(
    task: &Task,
    nth: usize,
    intrinsics: Intrinsics,
    camera_from_world: Isometry3<f64>,
) -> Camera {
    Camera {
        name: task.names[nth].clone(),
        intrinsics,
        camera_from_world,
    }
}

/// Calibrates every camera separately.
fn each_alone(
    task: &Task,
    sights: &[Sight],
    started: &[Intrinsics],
) -> Result<Outcome, BoardError> {
    let mut all: Option<Outcome> = None;
    for (nth, start) in started.iter().enumerate() {
        let own: Vec<Sight> = sights.iter().filter(|sight| sight.camera == nth).cloned().collect();
        let frames = choose::frames(&own, &task.sizes, task.most_frames);
        let placed = placed(task, &own, started);
        let cameras: Vec<Camera> = (0..task.names.len())
            .map(|i| camera_of(task, i, started[i], Isometry3::identity()))
            .collect();
        let mut free = vec![Free::default(); cameras.len()];
        free[nth] = free_of(task, nth, false);
        let boards = boards(task, &cameras, &placed, &frames);
        let mut outcome = adjusted(task, cameras, &free, &boards)?;
        let mut own_outcome = outcome.cameras.swap_remove(nth);
        own_outcome.n_boards[0] = own.len();
        own_outcome.is_known = task.known[nth] == Some(*start);
        if let Some(all) = &mut all {
            all.cameras.push(own_outcome);
            all.sigma_px = all.sigma_px.max(outcome.sigma_px);
        } else {
            outcome.cameras = vec![own_outcome];
            all = Some(outcome);
        }
    }
    let mut outcome = all.ok_or(BoardError::NotFinite)?;
    outcome.boards.clear();
    verdict::doubt(task, &mut outcome);
    Ok(outcome)
}

/// Returns the known intrinsics, or the intrinsics estimated from the camera's own boards.
fn first_intrinsics(
    task: &Task,
    camera: usize,
    sights: &[Sight],
) -> Result<Intrinsics, BoardError> {
    let own: Vec<Sight> = sights.iter().filter(|sight| sight.camera == camera).cloned().collect();
    let name = || task.names[camera].clone();
    let least = if task.known[camera].is_some() {
        1
    } else {
        LEAST_BOARDS
    };
    if own.len() < least {
        return Err(BoardError::TooFewBoards {
            camera: name(),
            n: own.len(),
            least,
        });
    }
    if let Some(known) = task.known[camera] {
        return Ok(known);
    }
    let frames = choose::frames(&own, &task.sizes, MOST_FOR_START);
    let chosen = own.iter().filter(|sight| frames.contains(&sight.frame));
    let boards: Vec<_> = chosen.map(Sight::sighted).collect();
    let kind = task.lens;
    // A fit of eight coefficients starts from a fit of five, because the latter converges from less accurate initial values.
    let first = if kind == LensKind::Eight {
        LensKind::Five
    } else {
        kind
    };
    intrinsics::start(task.sizes[camera], first, &boards)
        .and_then(|start| intrinsics::adjusted(start, first, &boards))
        .ok_or_else(|| BoardError::NoStart { camera: name() })
}

/// A sight with the possible poses of the board, one for each orientation in which it looks the same.
#[derive(Clone)]
struct Placed {
    sight: Sight,
    ways: Vec<(Sight, Isometry3<f64>)>,
}

fn placed(task: &Task, sights: &[Sight], started: &[Intrinsics]) -> Vec<Placed> {
    let mut list = Vec::new();
    for sight in sights {
        let turned = task.look_alikes.iter().map(|numbers| sight.renumbered(numbers, &task.board));
        let ways = core::iter::once(sight.clone()).chain(turned);
        let ways: Vec<(Sight, Isometry3<f64>)> = ways
            .filter_map(|way| {
                let pose = board_pose(&started[way.camera], &way.sighted())?;
                (pose.rms_px < 50.0).then_some((way, pose.camera_from_board))
            })
            .collect();
        if !ways.is_empty() {
            list.push(Placed {
                sight: sight.clone(),
                ways,
            });
        }
    }
    list
}

fn pairs(task: &Task, placed: &[Placed]) -> (Vec<([usize; 2], Pair)>, Vec<Together>) {
    let (mut pairs, mut together) = (Vec::new(), Vec::new());
    for a in 0..task.names.len() {
        for b in a + 1..task.names.len() {
            let mut meetings = Vec::new();
            for one in placed.iter().filter(|placed| placed.sight.camera == a) {
                let same = placed.iter().filter(|placed| {
                    placed.sight.camera == b && placed.sight.frame == one.sight.frame
                });
                for other in same {
                    let first = one.ways[0].1;
                    let n = one.sight.points.len().min(other.sight.points.len());
                    meetings.push(Meeting {
                        a_from_b: other.ways.iter().map(|way| first * way.1.inverse()).collect(),
                        weight: n as f64,
                    });
                }
            }
            if let Some(found) = pair(&meetings) {
                together.push(Together {
                    cameras: [a, b],
                    n: found.n,
                    n_agree: found.n_agree,
                });
                pairs.push(([a, b], found));
            }
        }
    }
    (pairs, together)
}

/// Returns the pose of the board in the world in every frame. Each camera suggests a pose; the one with the lowest cost over all cameras
/// is chosen.
fn boards(task: &Task, cameras: &[Camera], placed: &[Placed], frames: &[usize]) -> Vec<Shown> {
    let mut list = Vec::new();
    for &frame in frames {
        let own: Vec<&Placed> =
            placed.iter().filter(|placed| placed.sight.frame == frame).collect();
        let candidates = own.iter().map(|placed| {
            let camera = &cameras[placed.sight.camera];
            camera.camera_from_world.inverse() * placed.ways[0].1
        });
        let judged = candidates.map(|pose| {
            let ways: Vec<(f64, Sight)> = own
                .iter()
                .filter_map(|placed| {
                    let costs = placed
                        .ways
                        .iter()
                        .map(|(way, _)| (cost(&cameras[way.camera], &pose, way), way.clone()));
                    costs.min_by(|a, b| a.0.total_cmp(&b.0))
                })
                .collect();
            (ways.iter().map(|way| way.0).sum::<f64>(), pose, ways)
        });
        let Some((_, pose, ways)) = judged.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            continue;
        };
        list.push(Shown {
            frame,
            world_from_board: pose * middle(task),
            spreads: vec![1.0; ways.len()],
            sights: ways.into_iter().map(|way| way.1).collect(),
        });
    }
    list
}

/// Returns the mean length of a sight's residuals; very long residuals are capped.
fn cost(camera: &Camera, world_from_board: &Isometry3<f64>, sight: &Sight) -> f64 {
    let each = sight.sighted().into_iter().map(|(on_board, at)| {
        let in_world = world_from_board * Point3::new(on_board.x, on_board.y, 0.0);
        let image = camera.project(&in_world);
        image.map_or(100.0, |image| (image - at).norm().min(100.0))
    });
    each.sum::<f64>() / sight.points.len().max(1) as f64
}
