//! Refinement of an existing rig from a recording, or repair of a rig after a camera was moved.
//!
//! The poses of the given rig are assumed to be correct up to stated standard deviations. The prior on a camera's pose has a loss that
//! saturates, so that the prior does not hold a moved camera at its old pose. A camera is changed only if the joints determine its pose
//! better than the prior does; otherwise its pose is fixed. The new rig is evaluated on parts of the recording that were not used for the
//! fit. In these parts, each camera's joints are compared with the positions that the other cameras predict.

mod held_out;

#[cfg(test)]
mod tests;

use geometry::Camera;
use geometry::bundle::{Cameras, Free, covariance};
use statistics::Sorted;

use crate::align::Difference;
use crate::people::adjust::{Beliefs, PosePrior};
use crate::people::begin::{Choice, Study};
use crate::people::certainty::{MOST_HALVES, half_of};
use crate::people::estimate::{LEAST_INSTANTS, LEAST_SEEN_S, check_joints, instants};
use crate::people::measure::fits;
use crate::people::sightings::{Chain, chains, ideal, interval_s, longest};
use crate::people::solve::{Solved, rounds};
use crate::people::{Doubt, PeopleError, Recording, Skeletons};
use held_out::{Blocks, chosen};

/// A camera is changed if the standard deviation of its new pose is below this fraction of the prior's standard deviation.
const TOLD: f64 = 0.8;
/// A camera counts as moved if the fit of the joints improves by at least the first value, as a fraction, when only this camera's pose is
/// free. The improvement must also be larger, by the second value as a factor, than the improvement for any other camera.
const SUSPECT: [f64; 2] = [0.15, 1.5];

/// Settings of a refinement.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Number of joints; the first 14 are those of `skeleton::PARSE14`.
    pub n_joints: usize,
    /// For each joint, the index of the corresponding joint on the other side of the body.
    pub sides: Vec<usize>,
    /// Offset to add to the times of each camera to get common times, in seconds.
    pub offsets_s: Vec<f64>,
    /// Standard deviation of the offsets, in seconds.
    pub offset_sd_s: f64,
    /// Standard deviations of the given poses, in degrees and metres.
    pub pose_sd: [f64; 2],
    /// True if focal lengths are refined as well.
    pub focal: bool,
    /// Maximum number of instants to use.
    pub most_instants: usize,
}

/// Change of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Distance by which the camera has moved, in degrees and metres.
    pub moved: [f64; 2],
    /// Standard deviation of the new pose, in degrees and metres.
    pub sd: [f64; 2],
    /// True if the joints determine the pose of the camera; otherwise the pose is fixed.
    pub is_told: bool,
    /// Median residual of the rig fitted to the whole recording, in pixels.
    pub residual_px: f64,
    /// Median distance of the camera's joints from the positions that the other cameras predict, on held-out parts of the recording, in
    /// pixels: with the given rig, then with the new one.
    pub held_out_px: [f64; 2],
    /// Offset to add to the camera's times to get common times, in seconds.
    pub offset_s: f64,
}

/// Result of a refinement.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The new rig.
    pub cameras: Vec<Camera>,
    /// Changes of the cameras; empty if the rig could not be refined.
    pub changes: Vec<Change>,
    /// Median distance over all cameras, on held-out parts of the recording, in pixels: with the given rig, then with the new one.
    pub held_out_px: [f64; 2],
    /// Mean improvement over the held-out blocks, divided by its standard error. A value above 2 is unlikely to be due to chance.
    pub certainty: f64,
    /// Number of held-out blocks of time, and number of blocks in which the new rig fits better.
    pub blocks: [usize; 2],
    /// True if the new rig is better.
    pub is_better: bool,
    /// Reasons to trust neither the given rig nor the new one.
    pub doubts: Vec<Doubt>,
    /// Number of instants that were used.
    pub n_instants: usize,
    /// Times of these instants, in seconds on the common clock.
    pub times_s: Vec<f64>,
    /// Skeletons by instant and joint, in the new rig, in metres.
    pub skeletons: Skeletons,
}

/// Refines a rig.
///
/// # Errors
///
/// Fails with [`PeopleError`] if the recording cannot be used at all. If it determines too little, the result is an [`Outcome`] with
/// doubts.
pub fn refine(recording: &Recording<'_>, settings: &Settings) -> Result<Outcome, PeopleError> {
    let Recording { cameras, films } = *recording;
    if cameras.len() < 2 || cameras.len() != films.len() {
        return Err(PeopleError::Number {
            cameras: cameras.len(),
            films: films.len(),
        });
    }
    check_joints(settings.n_joints, &settings.sides)?;
    let interval_s = films.iter().filter_map(interval_s).fold(0.0, f64::max);
    let each = cameras.iter().zip(films);
    let chains: Vec<Vec<Chain>> = each
        .map(|(camera, film)| chains(film, camera, settings.n_joints, interval_s))
        .collect();
    let mut outcome = nothing(cameras);
    for (camera, of) in chains.iter().enumerate() {
        let seen_s = longest(of).map_or(0.0, Chain::seen_s);
        if seen_s < LEAST_SEEN_S {
            let least_s = LEAST_SEEN_S;
            outcome.doubts.push(Doubt::NoPeople {
                camera,
                seen_s,
                least_s,
            });
        }
    }
    let wanted = (&settings.offsets_s[..], settings.most_instants);
    let times_s = instants(&chains, wanted, interval_s);
    let (n, least) = (times_s.len(), 2 * LEAST_INSTANTS);
    if outcome.doubts.is_empty() && n < least {
        outcome.doubts.push(Doubt::FewInstants { n, least });
    }
    if !outcome.doubts.is_empty() {
        return Ok(outcome);
    }
    outcome.n_instants = n;
    let mut study = Study {
        cameras: cameras.iter().map(ideal).collect(),
        chains: &chains,
        choices: Vec::new(),
        times_s,
        n_joints: settings.n_joints,
        sides: &settings.sides,
    };
    let choices = chosen(&study, &settings.offsets_s);
    study.choices = choices.iter().map(|choice| vec![*choice]).collect();
    match better(&study, &choices, settings, &mut outcome) {
        Ok(all) => finish(&mut outcome, (cameras, &study), &all),
        Err(doubt) => outcome.doubts.push(doubt),
    }
    Ok(outcome)
}

fn nothing(cameras: &[Camera]) -> Outcome {
    Outcome {
        cameras: cameras.to_vec(),
        changes: Vec::new(),
        held_out_px: [f64::NAN; 2],
        certainty: 0.0,
        blocks: [0; 2],
        is_better: false,
        doubts: Vec::new(),
        n_instants: 0,
        times_s: Vec::new(),
        skeletons: Vec::new(),
    }
}

/// Returns the rig fitted to all data. Its quality is judged by fitting each half of the data and testing on the other half.
fn better(
    study: &Study<'_>,
    choices: &[Choice],
    settings: &Settings,
    outcome: &mut Outcome,
) -> Result<Solved, Doubt> {
    let everything = Moving {
        suspect: suspect(study, choices, settings)?,
        told: vec![true; choices.len()],
    };
    let told = told(&fitted(study, choices, settings, &everything)?, settings);
    let moving = Moving { told, ..everything };
    let span = [study.times_s[0], study.times_s[study.times_s.len() - 1]];
    let mut blocks = Blocks::default();
    let mut rigs = Vec::new();
    for half in 0..2 {
        let part = |wanted: usize| Study {
            times_s: study
                .times_s
                .iter()
                .copied()
                .filter(|times_s| half_of(*times_s, span) == wanted)
                .collect(),
            ..study.clone()
        };
        let fit = fitted(&part(half), choices, settings, &moving)?;
        let rest = part(1 - half);
        blocks.add(
            &rest,
            (&study.cameras, choices),
            (fit.cameras(), &fit.choices),
        );
        rigs.push(fit.cameras().to_vec());
    }
    let all = fitted(study, choices, settings, &moving)?;
    blocks.judge(outcome);
    disagreement(&rigs, &all, settings, outcome);
    outcome.changes = changes(study, &all, &moving.told, &blocks);
    Ok(all)
}

/// The cameras that may change.
#[derive(Debug, Clone)]
struct Moving {
    /// Index of a camera that was moved; its pose has no prior.
    suspect: Option<usize>,
    /// True for each camera whose pose the joints determine; the poses of all other cameras are fixed.
    told: Vec<bool>,
}

/// Returns the camera that was moved, if any. If only the pose of this camera is free, the fit of the joints improves much more than with
/// any other camera.
fn suspect(
    study: &Study<'_>,
    choices: &[Choice],
    settings: &Settings,
) -> Result<Option<usize>, Doubt> {
    let n = choices.len();
    if n < 3 {
        return Ok(None);
    }
    let held = Settings {
        offset_sd_s: 0.0,
        ..settings.clone()
    };
    let residual = |suspect: Option<usize>| -> Result<f64, Doubt> {
        let moving = Moving {
            suspect,
            told: vec![false; n],
        };
        let all = fitted(study, choices, &held, &moving)?;
        let fits = fits(&all.problem, &all.sigmas_px);
        let shares = fits.iter().zip(choices).enumerate();
        let shares =
            shares.map(|(camera, (fit, it))| fit.median_px / study.chains[camera][it.chain].size());
        Ok(shares.sum::<f64>() / n as f64)
    };
    let before = residual(None)?;
    let mut each = Vec::new();
    for camera in 0..n {
        each.push((before - residual(Some(camera))?, camera));
    }
    each.sort_by(|a, b| b.0.total_cmp(&a.0));
    let [best, second] = [each[0], each[1]];
    let is_one = best.0 > SUSPECT[0] * before && best.0 > SUSPECT[1] * second.0;
    Ok(is_one.then_some(best.1))
}

/// Returns the rig that best fits both the joints and the given rig. Cameras whose poses the joints do not determine keep their given
/// poses.
fn fitted(
    study: &Study<'_>,
    choices: &[Choice],
    settings: &Settings,
    moving: &Moving,
) -> Result<Solved, Doubt> {
    let of = |camera: usize| {
        let is_free = moving.told[camera] || moving.suspect == Some(camera);
        Free {
            pose: is_free,
            focal: settings.focal && is_free,
            ..Free::default()
        }
    };
    let free: Vec<Free> = (0..choices.len()).map(of).collect();
    let prior = |(camera, it): (usize, &Camera)| {
        (moving.suspect != Some(camera)).then(|| PosePrior {
            camera: it.clone(),
            sd: [settings.pose_sd[0].to_radians(), settings.pose_sd[1]],
        })
    };
    let beliefs = Beliefs {
        baseline: None,
        poses: study.cameras.iter().enumerate().map(prior).collect(),
        offset_sd_s: (settings.offset_sd_s > 0.0).then_some(settings.offset_sd_s),
        focal_sd: 0.02,
        bias_sd_px: None,
    };
    let cameras = Cameras::new(study.cameras.clone(), &free);
    rounds(study, cameras, choices.to_vec(), &beliefs)
}

/// Returns the standard deviation of every camera's pose, in degrees and metres. It is 0 for a camera with a fixed pose, and infinite if
/// nothing determines the pose.
fn deviations(all: &Solved) -> Vec<[f64; 2]> {
    let inflation = all.report.variance().sqrt().max(1.0);
    // Giving the priors more weight has the same effect as giving the joints less.
    let known = covariance(&all.problem.believing(inflation)).ok();
    let cameras = all.problem.cameras();
    let of = |camera: usize| {
        let Some(pose) = cameras.pose_parameters(camera) else {
            return [0.0; 2];
        };
        let sd = |own: &[usize]| {
            let squares = own.iter().map(|parameter| {
                known.as_ref().map_or(f64::INFINITY, |known| known.sd(*parameter).powi(2))
            });
            inflation * (squares.sum::<f64>() / 3.0).sqrt()
        };
        [sd(&pose[..3]).to_degrees(), sd(&pose[3..])]
    };
    (0..cameras.cameras().len()).map(of).collect()
}

/// Finds the cameras that the joints determine better than the given rig does.
fn told(all: &Solved, settings: &Settings) -> Vec<bool> {
    let each = deviations(all).into_iter();
    each.map(|sd| sd[0] < TOLD * settings.pose_sd[0] || sd[1] < TOLD * settings.pose_sd[1])
        .collect()
}

/// Compares the rigs fitted to the two halves of the recording, and adds doubts if they differ too much.
fn disagreement(rigs: &[Vec<Camera>], all: &Solved, settings: &Settings, outcome: &mut Outcome) {
    let [one, other] = rigs else { return };
    let skeletons = all.skeletons(settings.n_joints);
    let points: Vec<_> = skeletons.iter().flatten().flatten().collect();
    let axis = |axis: usize| {
        Sorted::new(points.iter().map(|point| point[axis]).collect::<Vec<_>>()).upper_median()
    };
    let middle = [0, 1, 2].map(|i| axis(i).unwrap_or(0.0)).into();
    for (camera, (a, b)) in one.iter().zip(other).enumerate() {
        let apart = difference(a, b);
        let distance = nalgebra::distance(&a.centre_in_world(), &middle);
        let by = [apart.turn.to_degrees(), apart.way / distance];
        let limits = MOST_HALVES;
        // The comparison is negated so that NaN counts as too large.
        if !(by[0] < limits[0] && by[1] < limits[1]) {
            outcome.doubts.push(Doubt::Halves { camera, by, limits });
        }
    }
}

fn difference(a: &Camera, b: &Camera) -> Difference {
    Difference {
        turn: a.camera_from_world.rotation.angle_to(&b.camera_from_world.rotation),
        way: (a.centre_in_world() - b.centre_in_world()).norm(),
    }
}

fn changes(study: &Study<'_>, all: &Solved, told: &[bool], blocks: &Blocks) -> Vec<Change> {
    let fits = fits(&all.problem, &all.sigmas_px);
    let sds = deviations(all);
    let each = study.cameras.iter().zip(all.cameras()).enumerate();
    each.map(|(camera, (before, after))| {
        let moved = difference(before, after);
        Change {
            moved: [moved.turn.to_degrees(), moved.way],
            sd: sds[camera],
            is_told: told[camera],
            residual_px: fits[camera].median_px,
            held_out_px: blocks.of_camera(camera),
            offset_s: all.choices[camera].offset_s,
        }
    })
    .collect()
}

fn finish(outcome: &mut Outcome, (given, study): (&[Camera], &Study<'_>), all: &Solved) {
    let placed = all.cameras().iter().zip(given).map(|(found, given)| {
        let mut camera = found.clone();
        camera.intrinsics.lens = given.intrinsics.lens;
        camera
    });
    outcome.cameras = placed.collect();
    outcome.times_s.clone_from(&study.times_s);
    outcome.skeletons = all.skeletons(study.n_joints);
    if !all.report.is_converged() {
        let iterations = all.report.iterations;
        outcome.doubts.push(Doubt::NotConverged { iterations });
    }
    for (camera, change) in outcome.changes.iter().enumerate() {
        let size = study.chains[camera][all.choices[camera].chain].size();
        let fit = Doubt::of_fit(camera, change.residual_px, size);
        outcome.doubts.extend(fit);
    }
}
