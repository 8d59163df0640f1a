//! The whole estimation: selection of data, the rig, and doubts about it.

use crate::synchronisation::Film;
use fastrand::Rng;
use geometry::Camera;
use geometry::bundle::{Covariance, clustered};
use nalgebra::Point3;
use skeleton::body::N_JOINTS;

use super::begin::{Study, choices};
use super::certainty::{blocks, certainty, halves, spread};
use super::doubt::Doubt;
use super::frame::{Scale, Vertical, World, bone_spread, stature_of, world};
use super::measure::{CELLS, Fit, fits};
use super::outcome::{CameraReport, Outcome};
use super::sightings::{Chain, chains, ideal, interval_s, longest};
use super::solve::{Clocks, Solved, Wanted, with_clocks};
use super::{Recording, Settings};

/// Minimum time for which each camera must see people, in seconds.
pub(crate) const LEAST_SEEN_S: f64 = 0.5;
/// Minimum number of instants.
pub(crate) const LEAST_INSTANTS: usize = 12;
/// Largest accepted change of bone lengths, as a fraction.
const MOST_BONES: f64 = 0.2;

/// Reason why a recording cannot be used at all.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PeopleError {
    /// There is only one camera, or the number of films differs from the number of cameras.
    #[error(
        "there are {cameras} cameras and footage of {films}, but at least 2 cameras are needed, each with its footage"
    )]
    Number {
        /// Number of cameras.
        cameras: usize,
        /// Number of films.
        films: usize,
    },
    /// There are fewer joints than a body has, or `sides` does not have one entry per joint.
    #[error("there are {joints} joints and {sides} sides, but at least {least} joints are needed, each with its side", least = N_JOINTS)]
    Joints {
        /// Number of joints.
        joints: usize,
        /// Number of entries in `sides`.
        sides: usize,
    },
    /// A length is not a positive number.
    #[error("the length is {metres} m, but a positive number is needed")]
    Length {
        /// The length, in metres.
        metres: f64,
    },
}

/// Estimates the poses of the cameras.
///
/// # Errors
///
/// Fails with [`PeopleError`] if the recording cannot be used at all. If it determines too little, the result is an [`Outcome`] with
/// doubts.
pub fn estimate(recording: &Recording<'_>, settings: &Settings) -> Result<Outcome, PeopleError> {
    let Recording { cameras, films } = *recording;
    check(cameras, films, settings)?;
    let interval_s = films.iter().filter_map(interval_s).fold(0.0, f64::max);
    let chains: Vec<Vec<Chain>> = cameras
        .iter()
        .zip(films)
        .map(|(camera, film)| chains(film, camera, settings.n_joints, interval_s))
        .collect();
    let mut outcome = nothing(cameras, settings);
    for (camera, of) in chains.iter().enumerate() {
        let seen_s = longest(of).map_or(0.0, Chain::seen_s);
        if seen_s < LEAST_SEEN_S {
            outcome.doubts.push(Doubt::NoPeople {
                camera,
                seen_s,
                least_s: LEAST_SEEN_S,
            });
        }
    }
    let times_s = instants(
        &chains,
        (&settings.offsets_s, settings.most_instants),
        interval_s,
    );
    if outcome.doubts.is_empty() && times_s.len() < LEAST_INSTANTS {
        outcome.doubts.push(Doubt::FewInstants {
            n: times_s.len(),
            least: LEAST_INSTANTS,
        });
    }
    if !outcome.doubts.is_empty() {
        return Ok(outcome);
    }
    outcome.span_s = [times_s[0], times_s[times_s.len() - 1]];
    let of = |(camera, it): (usize, &Vec<Chain>)| {
        let offset_s = settings.offsets_s.get(camera).copied().unwrap_or(0.0);
        choices(it.len(), offset_s, settings.window_s, settings.as_seen)
    };
    let study = Study {
        cameras: cameras.iter().map(ideal).collect(),
        chains: &chains,
        choices: chains.iter().enumerate().map(of).collect(),
        times_s,
        n_joints: settings.n_joints,
        sides: &settings.sides,
    };
    outcome.n_instants = study.times_s.len();
    answer(&mut outcome, (cameras, &study), settings);
    Ok(outcome)
}

/// Solves for the rig, and adds doubts and uncertainties to the outcome.
fn answer(outcome: &mut Outcome, given: (&[Camera], &Study<'_>), settings: &Settings) {
    let (study, focal) = (given.1, settings.focal);
    let mut random = Rng::with_seed(settings.seed);
    let searches = settings.window_s > 0.0;
    match with_clocks(study, (focal, searches), &mut random) {
        Ok((all, clocks)) => {
            outcome.clocks_are_found = clocks == Clocks::Found;
            judge(outcome, given, &all, settings);
            halves(outcome, study, &all, Wanted { focal, clocks }, &mut random);
            certainty(outcome, study, &all);
        }
        Err(doubt) => outcome.doubts.push(doubt),
    }
}

fn check(cameras: &[Camera], films: &[Film], settings: &Settings) -> Result<(), PeopleError> {
    if cameras.len() < 2 || cameras.len() != films.len() {
        return Err(PeopleError::Number {
            cameras: cameras.len(),
            films: films.len(),
        });
    }
    check_joints(settings.n_joints, &settings.sides)?;
    match settings.scale {
        Scale::Height(metres) | Scale::Distance(_, _, metres)
            if !(metres.is_finite() && metres > 0.0) =>
        {
            Err(PeopleError::Length { metres })
        }
        _ => Ok(()),
    }
}

/// Checks that there are at least as many joints as a body has, and that every entry of `sides` is the index of a joint.
pub(crate) fn check_joints(joints: usize, sides: &[usize]) -> Result<(), PeopleError> {
    if joints < N_JOINTS || sides.len() != joints || sides.iter().any(|side| *side >= joints) {
        let sides = sides.len();
        return Err(PeopleError::Joints { joints, sides });
    }
    Ok(())
}

fn nothing(cameras: &[Camera], settings: &Settings) -> Outcome {
    Outcome {
        cameras: cameras.to_vec(),
        up: None,
        vertical: if settings.scale == Scale::Rig {
            Vertical::Rig
        } else {
            Vertical::Leaning
        },
        scale_sd: f64::NAN,
        stature_m: None,
        reports: Vec::new(),
        doubts: Vec::new(),
        cautions: Vec::new(),
        clocks_are_found: false,
        n_instants: 0,
        span_s: [0.0; 2],
        n_exchanged: 0,
        times_s: Vec::new(),
        skeletons: Vec::new(),
    }
}

/// Returns instants at which at least two cameras see their first person, evenly distributed over the recording.
///
/// * `offsets_s`: offsets of the clocks; 0 for those that are not given. `most`: maximum number of instants.
pub(crate) fn instants(
    chains: &[Vec<Chain>],
    (offsets_s, most): (&[f64], usize),
    interval_s: f64,
) -> Vec<f64> {
    let spans: Vec<[f64; 2]> = chains
        .iter()
        .enumerate()
        .filter_map(|(camera, it)| {
            let offset_s = offsets_s.get(camera).copied().unwrap_or(0.0);
            Some(longest(it)?.span().map(|span| span + offset_s))
        })
        .collect();
    let mut froms: Vec<f64> = spans.iter().map(|span| span[0]).collect();
    let mut tos: Vec<f64> = spans.iter().map(|span| span[1]).collect();
    froms.sort_by(f64::total_cmp);
    tos.sort_by(|a, b| b.total_cmp(a));
    let (Some(from), Some(to)) = (froms.get(1), tos.get(1)) else {
        return Vec::new();
    };
    let length_s = to - from;
    if length_s <= 0.0 || interval_s <= 0.0 {
        return Vec::new();
    }
    let n = ((length_s / interval_s).round() as usize + 1).clamp(1, most.max(2));
    let step_s = length_s / (n.max(2) - 1) as f64;
    (0..n).map(|i| from + step_s * i as f64).collect()
}

/// Adds the doubts about a result.
fn judge(
    outcome: &mut Outcome,
    (given, study): (&[Camera], &Study<'_>),
    all: &Solved,
    settings: &Settings,
) {
    let skeletons = all.skeletons(settings.n_joints);
    let times_s = &study.times_s[..];
    let found = all.cameras();
    let made = world(found, (given, None), settings.scale, (times_s, &skeletons));
    let Some(World {
        to_metres,
        up,
        vertical,
        scale_sd,
    }) = made
    else {
        outcome.doubts.push(Doubt::NoBody);
        return;
    };
    (outcome.up, outcome.vertical, outcome.scale_sd) = (up, vertical, scale_sd);
    outcome.n_exchanged = all.n_exchanged;
    let placed = found.iter().zip(given).map(|(found, given)| {
        let mut camera = to_metres.camera(found);
        camera.intrinsics.lens = given.intrinsics.lens;
        camera
    });
    outcome.cameras = placed.collect();
    let to_metres_point = |point: &Option<Point3<f64>>| point.map(|point| to_metres.point(&point));
    outcome.times_s = times_s.to_vec();
    outcome.skeletons = skeletons
        .iter()
        .map(|skeleton| skeleton.iter().map(to_metres_point).collect())
        .collect();
    outcome.stature_m = stature_of(&outcome.skeletons).map(|stature| stature.0);
    let fits = fits(&all.problem, &all.sigmas_px);
    let blocks = blocks(&all.problem, &study.times_s);
    let known = clustered(&all.problem, &blocks);
    let deviations = known.as_ref().ok().and_then(Option::as_ref);
    let sds = deviations.map(|deviation| spread(all, deviation));
    outcome.reports = fits
        .into_iter()
        .enumerate()
        .map(|(camera, fit)| {
            let sd = sds.as_ref().map_or([f64::INFINITY; 2], |sd| sd[camera]);
            let sd = [sd[0], to_metres.scale * sd[1]];
            report((camera, sd), fit, all, deviations)
        })
        .collect();
    if !all.report.is_converged() {
        let iterations = all.report.iterations;
        outcome.doubts.push(Doubt::NotConverged { iterations });
    }
    if let Err(error) = known {
        let what = error.to_string();
        outcome.doubts.push(Doubt::Undetermined { what });
    }
    if let Some(spread) = bone_spread(&skeletons).filter(|value| *value > MOST_BONES) {
        let limit = MOST_BONES;
        outcome.doubts.push(Doubt::Bones { spread, limit });
    }
}

fn report(
    (camera, sd): (usize, [f64; 2]),
    fit: Fit,
    all: &Solved,
    known: Option<&Covariance>,
) -> CameraReport {
    debug_assert_eq!(fit.cells.len(), CELLS * CELLS, "a square of cells");
    let of = |parameter: usize| known.map_or(f64::INFINITY, |known| known.sd(parameter));
    let offset_sd = all.problem.offset_parameter(camera).map_or(0.0, of);
    CameraReport {
        joints: fit.n,
        residual_px: fit.median_px,
        inliers: fit.inliers,
        cells: fit.cells,
        sd,
        focal_sd_px: all.problem.cameras().focal_parameter(camera).map(of),
        halves: None,
        offset_s: [all.choices[camera].offset_s, offset_sd],
    }
}
