//! Steps from an initial rig to the adjustment of everything.

use fastrand::Rng;
use geometry::Camera;
use geometry::bundle::{Cameras, Free, Report, Settings as Search, solve};
use nalgebra::Point3;

use super::adjust::{Adjustment, Beliefs, skeletons};
use super::begin::{Choice, Start, Study};
use super::doubt::Doubt;
use super::measure::{Fit, biases, fits, sigmas};
use super::sides::exchange;
use super::sightings::Sightings;

/// Number of rounds. Each round determines clocks, left and right, and expected errors, then adjusts everything else.
const ROUNDS: usize = 4;
/// Standard deviation of an offset about its initial value, in seconds.
const OFFSET_SD_S: f64 = 0.1;
/// Standard deviation of an estimated focal length, as a fraction.
const FOCAL_SD: f64 = 0.1;

/// A solved rig in a world of its own, with the data it was solved from.
#[derive(Debug, Clone)]
pub(crate) struct Solved {
    pub(crate) choices: Vec<Choice>,
    pub(crate) problem: Adjustment,
    pub(crate) report: Report,
    /// Expected errors by camera and joint, in pixels.
    pub(crate) sigmas_px: Vec<Vec<f64>>,
    /// Number of pictures in which left and right were swapped.
    pub(crate) n_exchanged: usize,
}

impl Solved {
    pub(crate) fn cameras(&self) -> &[Camera] {
        self.problem.cameras().cameras()
    }

    /// Returns the skeletons, by instant and joint.
    pub(crate) fn skeletons(&self, n_joints: usize) -> Vec<Vec<Option<Point3<f64>>>> {
        skeletons(&self.problem, n_joints)
    }
}

/// The joints contradict the given clocks if other clocks improve the fit by at least this fraction.
const BETTER: f64 = 0.15;

/// Treatment of the clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Clocks {
    /// The given clocks are used.
    Given,
    /// The clocks are estimated.
    Found,
}

/// The parameters that are estimated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted {
    pub(crate) focal: bool,
    pub(crate) clocks: Clocks,
}

/// Solves a rig without prior poses. The given clocks are used unless the joints contradict them.
///
/// If a person walks in a circle, a change of a camera's clock looks much like a change of its position. Only the swing of the limbs
/// distinguishes the two, and errors of the joints have similar effects. Clocks with little effect on the fit of the joints are left
/// unchanged.
///
/// * `search`: true if clocks are searched over a wide range.
pub(crate) fn with_clocks(
    study: &Study<'_>,
    (focal, search): (bool, bool),
    random: &mut Rng,
) -> Result<(Solved, Clocks), Doubt> {
    let start = study.start(random)?;
    let of = |clocks: Clocks| from(study, start.clone(), Wanted { focal, clocks });
    let found = of(Clocks::Found);
    if search {
        return found.map(|solved| (solved, Clocks::Found));
    }
    let given = of(Clocks::Given);
    match (given, found) {
        (Ok(given), Ok(found)) => {
            let is_contradicted = misfit(study, &found) < (1.0 - BETTER) * misfit(study, &given);
            Ok(if is_contradicted {
                (found, Clocks::Found)
            } else {
                (given, Clocks::Given)
            })
        }
        (Ok(it), Err(_)) => Ok((it, Clocks::Given)),
        (Err(_), Ok(it)) => Ok((it, Clocks::Found)),
        (Err(doubt), Err(_)) => Err(doubt),
    }
}

/// Returns the mean over cameras of the median residual, as a fraction of the size of the person.
fn misfit(study: &Study<'_>, it: &Solved) -> f64 {
    let fits = fits(&it.problem, &it.sigmas_px);
    let n = fits.len() as f64;
    let each = fits.iter().zip(&it.choices).enumerate();
    let share = |(camera, (fit, choice)): (usize, (&Fit, &Choice))| {
        fit.median_px / study.chains[camera][choice.chain].size()
    };
    each.map(share).sum::<f64>() / n
}

/// Solves a rig without prior poses.
pub(crate) fn solved(study: &Study<'_>, wanted: Wanted, random: &mut Rng) -> Result<Solved, Doubt> {
    from(study, study.start(random)?, wanted)
}

fn from(study: &Study<'_>, start: Start, wanted: Wanted) -> Result<Solved, Doubt> {
    let Start {
        cameras,
        choices,
        pair,
    } = start;
    let free: Vec<Free> = (0..cameras.len())
        .map(|camera| Free {
            pose: camera != pair[0],
            focal: wanted.focal,
            ..Free::default()
        })
        .collect();
    let beliefs = Beliefs {
        baseline: Some((pair[0], pair[1], 1.0)),
        offset_sd_s: (wanted.clocks == Clocks::Found).then_some(OFFSET_SD_S),
        focal_sd: FOCAL_SD,
        ..Beliefs::default()
    };
    rounds(study, Cameras::new(cameras, &free), choices, &beliefs)
}

/// Alternately determines clocks, left and right, and expected errors, and adjusts everything else.
pub(crate) fn rounds(
    study: &Study<'_>,
    mut cameras: Cameras,
    mut choices: Vec<Choice>,
    beliefs: &Beliefs,
) -> Result<Solved, Doubt> {
    let size = |(camera, it): (usize, &Choice)| study.chains[camera][it.chain].size();
    let sizes_px: Vec<f64> = choices.iter().enumerate().map(size).collect();
    let mut expected: Option<Vec<Vec<f64>>> = None;
    let mut beliefs = beliefs.clone();
    let mut last = None;
    for round in 0..ROUNDS {
        let chosen: Vec<Option<Choice>> = choices.iter().copied().map(Some).collect();
        let mut seen: Sightings = study.sightings(&chosen);
        let sigmas_px = expected.take().unwrap_or_else(|| study.sigmas(&chosen));
        let n_exchanged = exchange(cameras.cameras(), &mut seen, &sigmas_px, study.sides);
        let problem = Adjustment::new(cameras, &seen, &sigmas_px, beliefs.clone());
        if problem.n_points() == 0 {
            return Err(Doubt::NoPair);
        }
        let is_last = round + 1 == ROUNDS;
        let settings = Search {
            max_iterations: if is_last { 200 } else { 15 },
            least_gain: if is_last { 1e-6 } else { 1e-5 },
        };
        let (problem, report) = solve(problem, &settings);
        for (choice, step) in choices.iter_mut().zip(problem.offset_steps_s()) {
            choice.offset_s += step;
        }
        expected = Some(sigmas(&problem, &sizes_px, study.n_joints));
        beliefs.bias_sd_px = biases(&problem, &sizes_px, study.n_joints);
        cameras = problem.cameras().clone();
        last = Some(Solved {
            choices: choices.clone(),
            problem,
            report,
            sigmas_px,
            n_exchanged,
        });
    }
    last.ok_or(Doubt::NoPair)
}
