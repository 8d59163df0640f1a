//! Uncertainty of a rig, from differences between blocks of the recording and between its halves.

use fastrand::Rng;
use geometry::Camera;
use geometry::bundle::Covariance;
use nalgebra::{Point3, SymmetricEigen};
use statistics::Sorted;

use super::adjust::Adjustment;
use super::begin::{Choice, Study};
use super::doubt::Doubt;
use super::outcome::Outcome;
use super::solve::{Solved, Wanted, solved};
use crate::align::{Difference, aligned, differences};

/// Largest accepted standard deviation of a camera's pose: rotation in degrees, and position as a fraction of its distance to the people.
const MOST_SD: [f64; 2] = [1.5, 0.04];
/// Standard deviation below which the pose of a camera counts as well known, in the units of [`MOST_SD`]. Calibrations should reach it.
const GOOD_SD: [f64; 2] = [0.3, 0.01];
/// Largest accepted difference between the rigs from the two halves of the recording. If the error of the rig from the whole recording is
/// `MOST_SD`, the error of each half is √2 times as large, and the difference between two halves is √2 times that again.
pub(crate) const MOST_HALVES: [f64; 2] = [2.0 * MOST_SD[0], 2.0 * MOST_SD[1]];
/// Minimum length of a block of the recording, in seconds. The blocks belong to the first half and the second half alternately.
pub(crate) const BLOCK_S: f64 = 1.0;
/// Minimum and maximum number of blocks from which the standard deviations are computed. With 8 blocks, a standard deviation is known to 27
/// %; with 16 blocks, to 18 %. Fewer, longer blocks account better for errors that are common to neighbouring instants.
const BLOCKS: [f64; 2] = [8.0, 16.0];

/// Returns the blocks of time to which the local blocks of an adjustment belong.
pub(super) fn blocks(problem: &Adjustment, times_s: &[f64]) -> Vec<usize> {
    let [from, to] = [times_s[0], times_s[times_s.len() - 1]];
    let n = ((to - from) / BLOCK_S).floor().clamp(BLOCKS[0], BLOCKS[1]);
    let of = |nth: usize| {
        let share = (times_s[nth] - from) / (to - from).max(f64::MIN_POSITIVE);
        (share * n).floor().clamp(0.0, n - 1.0) as usize
    };
    problem.numbers().map(of).collect()
}

/// Returns the standard deviation of every camera's pose, in degrees and units of the solution. Along each axis of the covariance, the rig
/// is moved by one standard deviation and then aligned with the rig that was found. In this way, no camera counts as exact.
pub(super) fn spread(all: &Solved, known: &Covariance) -> Vec<[f64; 2]> {
    let cameras = all.problem.cameras();
    let n = cameras.n_parameters();
    let own = known.matrix.view((0, 0), (n, n)).into_owned();
    let eigen = SymmetricEigen::new(own);
    let mut sums = vec![[0.0; 2]; cameras.cameras().len()];
    for (variance, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        let step = axis * variance.max(0.0).sqrt();
        let moved = cameras.moved(step.as_slice());
        let apart = differences(moved.cameras(), cameras.cameras(), true);
        for (sum, it) in sums.iter_mut().zip(apart) {
            sum[0] += it.turn.to_degrees().powi(2);
            sum[1] += it.way.powi(2);
        }
    }
    sums.iter().map(|sum| sum.map(f64::sqrt)).collect()
}

/// Returns the distance of each camera to the people, in metres.
fn distances(outcome: &Outcome) -> Vec<f64> {
    let all: Vec<&Point3<f64>> = outcome.skeletons.iter().flatten().flatten().collect();
    let axis = |axis: usize| {
        Sorted::new(all.iter().map(|point| point[axis]).collect::<Vec<_>>()).upper_median()
    };
    let middle = Point3::new(
        axis(0).unwrap_or(0.0),
        axis(1).unwrap_or(0.0),
        axis(2).unwrap_or(0.0),
    );
    let each = outcome.cameras.iter();
    each.map(|camera| (camera.centre_in_world() - middle).norm()).collect()
}

/// Adds to the standard deviations of the rotations an error that no block of the recording shows. If a network finds the joints, rigs of
/// few cameras have the same rotation error in every block, a few tenths of a degree. This error is about as large as the median residual,
/// expressed as an angle.
fn add_common(outcome: &mut Outcome) {
    for (report, camera) in outcome.reports.iter_mut().zip(&outcome.cameras) {
        let focal_px = 0.5 * (camera.intrinsics.fx + camera.intrinsics.fy);
        let alike = (report.residual_px / focal_px).to_degrees();
        report.sd[0] = report.sd[0].hypot(alike);
    }
}

/// Adds doubts and cautions about the deviations and the fit of the joints.
pub(super) fn certainty(outcome: &mut Outcome, study: &Study<'_>, all: &Solved) {
    add_common(outcome);
    let distances = distances(outcome);
    for (camera, report) in outcome.reports.iter().enumerate() {
        let sd = [report.sd[0], report.sd[1] / distances[camera]];
        // The comparison is written so that NaN is not within the limits.
        let is_within = |limits: [f64; 2]| sd[0] < limits[0] && sd[1] < limits[1];
        let uncertain = |limits: [f64; 2]| Doubt::Uncertain { camera, sd, limits };
        if !is_within(MOST_SD) {
            outcome.doubts.push(uncertain(MOST_SD));
        } else if !is_within(GOOD_SD) {
            outcome.cautions.push(uncertain(GOOD_SD));
        }
        let size = study.chains[camera][all.choices[camera].chain].size();
        let fit = Doubt::of_fit(camera, report.residual_px, size);
        outcome.doubts.extend(fit);
    }
}

/// Enlarges the standard deviations if the two halves differ by more than the deviations suggest. All cameras get the same factor.
fn widen(outcome: &mut Outcome, apart: &[Difference]) {
    let of = |difference: &Difference| [0.5 * difference.turn.to_degrees(), 0.5 * difference.way];
    for axis in 0..2 {
        let told: f64 = outcome.reports.iter().map(|report| report.sd[axis].powi(2)).sum();
        let seen: f64 = apart.iter().map(|apart| of(apart)[axis].powi(2)).sum();
        let share = (seen / told).sqrt();
        for report in outcome.reports.iter_mut().filter(|_| share > 1.0) {
            report.sd[axis] *= share;
        }
    }
}

/// Returns the half to which an instant belongs; successive blocks belong to the two halves alternately.
pub(crate) fn half_of(time_s: f64, [from, to]: [f64; 2]) -> usize {
    let n = ((to - from) / BLOCK_S).floor().clamp(2.0, 16.0);
    let n = 2.0 * (n / 2.0).floor();
    let block = ((time_s - from) / (to - from).max(f64::MIN_POSITIVE) * n).floor();
    block.clamp(0.0, n - 1.0) as usize % 2
}

/// Calibrates both halves of the recording independently, and compares them with each other.
pub(super) fn halves(
    outcome: &mut Outcome,
    study: &Study<'_>,
    all: &Solved,
    wanted: Wanted,
    random: &mut Rng,
) {
    if outcome.reports.is_empty() {
        return;
    }
    let span = outcome.span_s;
    let mut rigs = Vec::new();
    for half in 0..2 {
        let near = |choice: &Choice| vec![*choice];
        let part = Study {
            times_s: study
                .times_s
                .iter()
                .copied()
                .filter(|times_s| half_of(*times_s, span) == half)
                .collect(),
            choices: all.choices.iter().map(near).collect(),
            ..study.clone()
        };
        match solved(&part, wanted, random) {
            Ok(it) => rigs.push(it.cameras().to_vec()),
            Err(why) => {
                let why = Box::new(why);
                outcome.doubts.push(Doubt::NoHalf { why });
                return;
            }
        }
    }
    let laid = rigs.iter().filter_map(|rig| {
        let similarity = aligned(rig, &outcome.cameras, true)?;
        Some(rig.iter().map(|camera| similarity.camera(camera)).collect())
    });
    let laid: Vec<Vec<Camera>> = laid.collect();
    let [one, other] = &laid[..] else { return };
    let apart = differences(one, other, true);
    let distances = distances(outcome);
    widen(outcome, &apart);
    let mut worst: Option<(f64, usize, [f64; 2])> = None;
    for (camera, it) in apart.iter().enumerate() {
        let by = [it.turn.to_degrees(), it.way / distances[camera]];
        outcome.reports[camera].halves = Some([by[0], it.way]);
        let excess = (by[0] / MOST_HALVES[0]).max(by[1] / MOST_HALVES[1]);
        // NaN counts as worst.
        if worst.is_none_or(|worst| excess > worst.0 || excess.is_nan()) {
            worst = Some((excess, camera, by));
        }
    }
    if let Some((_, camera, by)) = worst.filter(|worst| worst.0 > 1.0 || worst.0.is_nan()) {
        let limits = MOST_HALVES;
        outcome.doubts.push(Doubt::Halves { camera, by, limits });
    }
}
