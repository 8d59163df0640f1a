//! Fuses one pair of views by alternating exact single-view solutions until convergence.

use fmp::{Bounds, ExtraTerms, Pose, Responses, Solver};

use crate::consistency::{Consistency, PairTerms};
use crate::released::{ReleasedPair, ReleasedTerms};
use crate::{EnergyKind, PairInput, Settings, ViewPlan};

/// The start of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairStart {
    /// Candidate of each view.
    pub candidates: [usize; 2],
    /// True if left and right of the second view are swapped relative to the first.
    pub exchanged: bool,
}

/// One single-view solution of the optimisation.
#[derive(Debug, Clone, PartialEq)]
pub struct Iteration {
    /// The view that was solved, 0 or 1; the other view was the support.
    pub target: usize,
    /// Energy of the pair after the solution (`Paper`), or score of the target's pose (`Released`).
    pub score: f64,
    /// Mean movement of the target's part centres, in pixels.
    pub moved_px: f64,
    /// The target's pose after the solution.
    pub pose: Pose,
}

/// The result of a pair under one assumption about which view sees the person from behind.
#[derive(Debug, Clone, PartialEq)]
pub struct PairEstimate {
    /// The start of the optimisation.
    pub start: PairStart,
    /// The final joint energy (eq. 3); for `Released`, the sum of the last scores of the two views.
    pub energy: f64,
    /// The solutions, in order.
    pub iterations: Vec<Iteration>,
    /// True if the poses had converged at the end.
    pub converged: bool,
    /// For each part of the first view, true if its consistency terms were switched on. For `Released`, these are the switches while the
    /// first view was the support; those of the second view as a support are not included.
    pub active: Vec<bool>,
    /// The poses in the first and in the second view; parts have the names of the model, without swapping left and right.
    pub poses: [Pose; 2],
}

/// Maximises the joint energy of a pair from a given start.
///
/// Eq. 3 of the paper is maximised by solving one view exactly while the other view (the support) is fixed, then swapping roles (section
/// 6). The first support is the view whose expected errors have the smaller sum over its parts. If a view has no expected errors, it is the
/// view with the higher score.
///
/// Under [`EnergyKind::Paper`], a solution is accepted only if it raises the target's energy. With
/// [`SwitchBy::Either`](crate::SwitchBy::Either), both views maximise the same energy, so it never falls and a cycle is impossible. The
/// loop ends when a view does not move after a solution of the other: then neither view alone can raise the energy (up to the tolerance of
/// `epsilon_px`).
///
/// Under [`EnergyKind::Released`], every solution is accepted, whatever its score, as in the
/// authors' program, until both views have moved by at most `epsilon_px`. A cycle ends at the limit
/// of iterations.
///
/// * `evidence`: the responses of both views; they should include their bounds
///   ([`Responses::with_bounds`]) if they are solved more than once.
pub fn estimate_pair(
    solver: &Solver,
    settings: &Settings,
    pair: &PairInput<'_>,
    evidence: [&Responses<'_>; 2],
    start: PairStart,
) -> PairEstimate {
    match settings.energy {
        EnergyKind::Paper => paper(solver, settings, pair, evidence, start),
        EnergyKind::Released => released_pair(solver, settings, pair, evidence, start),
    }
}

fn paper(
    solver: &Solver,
    settings: &Settings,
    pair: &PairInput<'_>,
    evidence: [&Responses<'_>; 2],
    start: PairStart,
) -> PairEstimate {
    let terms = PairTerms::new(settings, pair, start.exchanged);
    let mut poses = [0, 1].map(|side| pair.views[side].candidates[start.candidates[side]].clone());
    let mut own = [0, 1].map(|side| own_score(solver, evidence[side], &poses[side]));
    let mut target = 1 - initial_support(pair, &poses);
    let mut incremental = evidence.map(|evidence| solver.incremental(evidence));
    let (mut iterations, mut converged) = (Vec::new(), false);
    for iteration in 0..settings.max_iterations {
        let consistency = Consistency::new(&terms, target, &poses[1 - target]);
        // Another candidate may agree better with the support than the current pose does.
        let guesses = pair.views[target].candidates.iter();
        let guesses = guesses.chain([&poses[target]]);
        let found = incremental[target].best(&consistency, guesses);
        debug_assert!(is_best(
            solver,
            evidence[target],
            &consistency,
            found.as_ref()
        ));
        let better = found.and_then(|pose| {
            let score = own_score(solver, evidence[target], &pose);
            let between = |a: &Pose, b: &Pose| terms.for_target(target, a, b);
            let term = match target {
                0 => between(&pose, &poses[1]),
                _ => between(&poses[0], &pose),
            };
            let before = own[target] + between(&poses[0], &poses[1]);
            (score + term > before).then_some((pose, score))
        });
        let (mut moved_px, mut same_types) = (0.0, true);
        if let Some((pose, score)) = better {
            moved_px = mean_movement(pair.views[target].plan, &poses[target], &pose);
            same_types = types(&poses[target]).eq(types(&pose));
            (poses[target], own[target]) = (pose, score);
        }
        iterations.push(Iteration {
            target,
            score: own[0] + own[1] + terms.between(&poses[0], &poses[1]),
            moved_px,
            pose: poses[target].clone(),
        });
        // From the second iteration on, the support has itself been solved against this target.
        if iteration > 0 && moved_px <= settings.epsilon_px && same_types {
            converged = true;
            break;
        }
        target = 1 - target;
    }
    PairEstimate {
        start,
        energy: own[0] + own[1] + terms.between(&poses[0], &poses[1]),
        iterations,
        converged,
        active: terms.active(),
        poses,
    }
}

fn released_pair(
    solver: &Solver,
    settings: &Settings,
    pair: &PairInput<'_>,
    evidence: [&Responses<'_>; 2],
    start: PairStart,
) -> PairEstimate {
    let released = ReleasedPair::new(settings, pair, start.exchanged);
    let mut poses = [0, 1].map(|side| pair.views[side].candidates[start.candidates[side]].clone());
    let mut target = 1 - initial_support(pair, &poses);
    let mut incremental = evidence.map(|evidence| solver.incremental(evidence));
    let (mut iterations, mut converged) = (Vec::<Iteration>::new(), false);
    for _ in 0..settings.max_iterations {
        let terms = ReleasedTerms::new(&released, target, &poses[1 - target]);
        let found = incremental[target].best(&terms, Some(&poses[target]));
        debug_assert!(is_best(solver, evidence[target], &terms, found.as_ref()));
        let Some(pose) = found else {
            break;
        };
        let moved_px = mean_movement(pair.views[target].plan, &poses[target], &pose);
        poses[target] = pose;
        iterations.push(Iteration {
            target,
            score: f64::from(poses[target].score),
            moved_px,
            pose: poses[target].clone(),
        });
        let settled = |iteration: &Iteration| iteration.moved_px <= settings.epsilon_px;
        if iterations.len() >= 2 && iterations[iterations.len() - 2..].iter().all(settled) {
            converged = true;
            break;
        }
        target = 1 - target;
    }
    PairEstimate {
        start,
        energy: poses.iter().map(|pose| f64::from(pose.score)).sum(),
        iterations,
        converged,
        active: released.weights()[0].clone(),
        poses,
    }
}

/// Returns true if the shortcuts gave the exact result. With bounds that do not belong to the evidence, always returns true.
pub(crate) fn is_best(
    solver: &Solver,
    evidence: &Responses<'_>,
    extra: &dyn ExtraTerms,
    found: Option<&Pose>,
) -> bool {
    let is_right = |given: &Bounds| {
        let right = solver.bounds(evidence);
        let mut levels = evidence.levels().iter().map(|&level| usize::from(level));
        levels.all(|level| given.levels()[level] == right.levels()[level])
    };
    !evidence.bounds().is_none_or(is_right) || solver.best(evidence, Some(extra)).as_ref() == found
}

/// Returns the score of a pose in its own view alone (eq. 1).
fn own_score(solver: &Solver, evidence: &Responses<'_>, pose: &Pose) -> f64 {
    f64::from(solver.score(evidence, pose, None))
}

/// Returns the first support: the view with the lower expected error, or the higher score if either view
/// has no expected errors; ties go to the first view.
fn initial_support(pair: &PairInput<'_>, poses: &[Pose; 2]) -> usize {
    let expected = pair
        .views
        .map(|view| view.sigma_px.map(|sigma_px| sigma_px.iter().sum::<f32>()));
    match expected {
        [Some(first), Some(second)] => usize::from(second < first),
        _ => usize::from(poses[1].score > poses[0].score),
    }
}

pub(crate) fn types(pose: &Pose) -> impl Iterator<Item = u8> {
    pose.parts.iter().map(|part| part.mixture)
}

/// Returns the mean distance between the part centres of two poses, in pixels.
pub(crate) fn mean_movement(plan: &ViewPlan, from: &Pose, to: &Pose) -> f64 {
    let movement = |part: usize| {
        let [a, b] = [from, to].map(|pose| plan.centre(pose, part));
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    let n = from.parts.len().min(to.parts.len());
    (0..n).map(movement).sum::<f64>() / n.max(1) as f64
}
