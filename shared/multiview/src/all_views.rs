//! Fuses all views at once: each view is solved in turn, supported by all other views, until
//! convergence.

use std::collections::BTreeMap;

use fmp::{ExtraTerms, Pose, Responses, Solver};

use crate::consistency::{Consistency, PairTerms};
use crate::optimise::{is_best, mean_movement, types};
use crate::{Epipolar, Iteration, PairInput, Settings, TypeTables, ViewInput};

/// All views of one frame that have a result.
#[derive(Clone, Copy)]
pub struct AllViewsInput<'a> {
    /// The views.
    pub views: &'a [ViewInput<'a>],
    /// Part-type tables of a pair `(first, second)` of indices into `views`, `first < second`.
    pub tables: &'a dyn Fn(usize, usize) -> Option<&'a TypeTables>,
    /// Weight of the terms of a pair. With 1, the terms of all pairs are used unchanged; with `1 / (n - 1)`, all views that support a view
    /// together weigh as much as the single other view of a pair.
    pub weight: f64,
}

/// The start of the optimisation of all views.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AllViewsStart<'a> {
    /// Candidate of every view.
    pub candidates: &'a [usize],
    /// For every view, true if its left and right are swapped relative to the first view.
    pub exchanged: &'a [bool],
}

/// The result of solving all views together.
#[derive(Debug, Clone, PartialEq)]
pub struct AllViewsEstimate {
    /// The final energy.
    pub energy: f64,
    /// The single-view solutions, in order; their targets are indices into the views.
    pub iterations: Vec<Iteration>,
    /// True if the poses had converged at the end.
    pub converged: bool,
    /// Fraction of the consistency terms that were switched on, over all pairs and parts.
    pub active: f64,
    /// The pose in every view; parts have the names of the model, without swapping left and right.
    pub poses: Vec<Pose>,
}

/// Maximises one energy over all views, from a given start.
///
/// The energy is the paper's eq. 3 with a sum over all views and all pairs of views, `sum_v S(v) + weight sum_{v<u} (alpha xi + beta
/// lambda)(v, u)`; the paper mentions this as future work. One view is solved exactly while all others are fixed. Its terms are the sums of
/// the terms that each other view alone would add, so the graph remains a tree. Views take turns, the least reliable first. A solution is
/// accepted only if the energy rises, so the energy never falls and a cycle is impossible (except with
/// [`SwitchBy::Support`](crate::SwitchBy::Support)). The loop ends when no view alone can raise the energy (up to the tolerance of
/// `epsilon_px`), or after `max_iterations / 2` solutions of every view.
///
/// The benefit was measured as PCP3D (in percent, from `parallax-lab eval`) on 134 instants: 120 of three views and 14 of four (see the
/// documentation of the crate). This method, with averaged terms (weight `1 / (n - 1)`) and two starts, was compared with averaging the
/// results of the pairs:
///
/// * With geometry alone, this method reaches 73.3 %, and pairs reach 71.0 %. It needs 15 single-view solutions, and pairs need 20 (with
///   four views: 23 and 40).
/// * With the network's expected errors, this method reaches 75.9 %, and pairs reach 75.1 %.
/// * If the terms are added instead of averaged (weight 1), it reaches 72.6 % with geometry alone, and needs 17 solutions (with four views:
///   32).
/// * With an earlier model, pairs were better for three views (73.4 % instead of 71.1 %).
/// * If one of the four cameras was rotated by two degrees, pairs are still better on these 14 instants with geometry alone (79.8 % instead
///   of 75.0 %). But they are worse on all 70 frames with part types (78.3 % instead of 80.0 %), and with the network (81.3 % instead of
///   84.3 %).
///
/// A deployment selects this method by `views = "all"` in its section `[paper]`, with the mean of the terms
/// and two starts.
///
/// [`EnergyKind::Released`](crate::EnergyKind::Released) has no such form; the terms are always
/// the paper's.
///
/// * `evidence`: the responses of every view; they should include their bounds.
///
/// # Panics
///
/// If the lists differ in length.
pub fn estimate_all_views(
    solver: &Solver,
    settings: &Settings,
    input: &AllViewsInput<'_>,
    evidence: &[&Responses<'_>],
    start: AllViewsStart<'_>,
) -> AllViewsEstimate {
    let n_views = input.views.len();
    assert_eq!(evidence.len(), n_views, "evidence of every view");
    let of_pair = Settings {
        alpha: settings.alpha * input.weight,
        beta: settings.beta * input.weight,
        ..settings.clone()
    };
    let inputs = inputs(input);
    let pairs = Pairs::new(&of_pair, &inputs, start.exchanged);
    let candidate = |(view, idx): (&ViewInput<'_>, &usize)| view.candidates[*idx].clone();
    let poses: Vec<Pose> = input.views.iter().zip(start.candidates).map(candidate).collect();
    let own_score = |view: usize, pose: &Pose| f64::from(solver.score(evidence[view], pose, None));
    let own = poses.iter().enumerate().map(|(view, pose)| own_score(view, pose));
    let mut state = State::new(own.collect(), poses, &pairs);
    let order = order(input, &state.poses);
    let mut solvers: Vec<_> =
        evidence.iter().map(|evidence| solver.incremental(evidence)).collect();
    let mut term_keys: Vec<TermKeys> = vec![TermKeys::default(); n_views];
    let (mut iterations, mut converged) = (Vec::new(), n_views < 2);
    let mut convergence = Convergence::new(n_views);
    let most = (settings.max_iterations * n_views).div_ceil(2);
    for &target in order.iter().cycle().take(if converged { 0 } else { most }) {
        let supports = pairs.supports(target, &state.poses, &mut term_keys[target]);
        let guesses = input.views[target].candidates.iter();
        let guesses = guesses.chain([&state.poses[target]]);
        let best = solvers[target].best(&supports, guesses);
        debug_assert!(is_best(solver, evidence[target], &supports, best.as_ref()));
        let before = state.poses[target].clone();
        if let Some(pose) = best {
            let own = own_score(target, &pose);
            state.take_if_better(target, own, pose, &pairs);
        }
        let after = &state.poses[target];
        let moved_px = mean_movement(input.views[target].plan, &before, after);
        let same_types = types(&before).eq(types(after));
        iterations.push(Iteration {
            target,
            score: state.energy(),
            moved_px,
            pose: after.clone(),
        });
        converged = convergence.after(moved_px <= settings.epsilon_px && same_types);
        if converged {
            break;
        }
    }
    AllViewsEstimate {
        energy: state.energy(),
        iterations,
        converged,
        active: pairs.active(),
        poses: state.poses,
    }
}

/// Detects when no view can move any more.
struct Convergence {
    n_views: usize,
    /// Number of solutions since the last one that changed its view.
    n_still: usize,
    has_moved: bool,
}

impl Convergence {
    fn new(n_views: usize) -> Self {
        Self {
            n_views,
            n_still: 0,
            has_moved: false,
        }
    }

    /// Counts a solution; returns true if the optimisation has converged.
    fn after(&mut self, is_still: bool) -> bool {
        self.n_still = if is_still { self.n_still + 1 } else { 0 };
        self.has_moved |= !is_still;
        // The last view that changed was solved against the current state of all others.
        self.n_still + usize::from(self.has_moved) >= self.n_views
    }
}

/// Returns the order in which views are solved: highest expected error first, or lowest score first if any
/// view has no expected errors. Ties are solved from the last view to the first.
fn order(input: &AllViewsInput<'_>, poses: &[Pose]) -> Vec<usize> {
    let expected = input.views.iter();
    let expected = expected.map(|view| view.sigma_px.map(|sigma_px| sigma_px.iter().sum::<f32>()));
    let trust: Vec<f32> = match expected.collect::<Option<Vec<f32>>>() {
        Some(errors) => errors.iter().map(|error| -error).collect(),
        None => poses.iter().map(|pose| pose.score).collect(),
    };
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by(|&a, &b| trust[a].total_cmp(&trust[b]).then(b.cmp(&a)));
    order
}

/// Returns all pairs of views, indexed as `[first][second - first - 1]`.
fn inputs<'a>(input: &AllViewsInput<'a>) -> Vec<Vec<PairInput<'a>>> {
    let n = input.views.len();
    let pair = |first: usize, second: usize| PairInput {
        views: [input.views[first], input.views[second]],
        epipolar: Epipolar::new(input.views[first].plan, input.views[second].plan),
        tables: (input.tables)(first, second),
    };
    let of_first = |first: usize| (first + 1..n).map(|second| pair(first, second)).collect();
    (0..n).map(of_first).collect()
}

/// The terms of all pairs, indexed as `[first][second - first - 1]`.
struct Pairs<'a> {
    terms: Vec<Vec<PairTerms<'a>>>,
}

impl<'a> Pairs<'a> {
    fn new(settings: &'a Settings, inputs: &'a [Vec<PairInput<'a>>], exchanged: &[bool]) -> Self {
        let of_first = |(first, pairs): (usize, &'a Vec<PairInput<'a>>)| {
            let seconds = exchanged[first + 1..].iter();
            let terms = pairs.iter().zip(seconds);
            let terms = terms
                .map(|(pair, second)| PairTerms::new(settings, pair, *second != exchanged[first]));
            terms.collect()
        };
        Self {
            terms: inputs.iter().enumerate().map(of_first).collect(),
        }
    }

    /// Returns the terms of two views, and the index of the first given view among the two.
    fn terms_of(&self, view: usize, other: usize) -> (&PairTerms<'a>, usize) {
        let (first, second) = (view.min(other), view.max(other));
        (
            &self.terms[first][second - first - 1],
            usize::from(view > other),
        )
    }

    /// Returns the consistency sums of a pose of one view and a pose of another.
    fn between(&self, view: usize, pose: &Pose, other: usize, others: &Pose) -> f64 {
        match self.terms_of(view, other) {
            (terms, 0) => terms.between(pose, others),
            (terms, _) => terms.between(others, pose),
        }
    }

    /// Like [`Self::between`], with the terms that are switched on while `view` is solved.
    fn for_target(&self, view: usize, pose: &Pose, other: usize, others: &Pose) -> f64 {
        match self.terms_of(view, other) {
            (terms, 0) => terms.for_target(0, pose, others),
            (terms, side) => terms.for_target(side, others, pose),
        }
    }

    /// Returns the terms that all other views add to a target.
    fn supports<'b>(
        &'b self,
        target: usize,
        poses: &'b [Pose],
        term_keys: &mut TermKeys,
    ) -> Supports<'b> {
        let others = (0..poses.len()).filter(|other| *other != target);
        let one = |other: usize| {
            let (terms, side) = self.terms_of(target, other);
            Consistency::new(terms, side, &poses[other])
        };
        let each: Vec<Consistency<'b>> = others.map(one).collect();
        let n_parts = poses[target].parts.len();
        let keys = (0..n_parts).map(|part| term_keys.key(&each, part)).collect();
        Supports { each, keys }
    }

    fn active(&self) -> f64 {
        let all = self.terms.iter().flatten().flat_map(PairTerms::active);
        let (on, n) = all.fold((0, 0), |(on, n), it| (on + usize::from(it), n + 1));
        f64::from(on as u32) / f64::from(n.max(1))
    }
}

/// Assigns numbers to the dependencies of a part's terms. A dependency does not fit into a `u64`, so each distinct one gets the next
/// number.
#[derive(Debug, Clone, Default)]
struct TermKeys {
    kinds: BTreeMap<(usize, Vec<Option<u64>>), u64>,
}

impl TermKeys {
    fn key(&mut self, each: &[Consistency<'_>], part: usize) -> u64 {
        let next = self.kinds.len() as u64;
        let kind = each.iter().map(|terms| terms.key(part)).collect();
        *self.kinds.entry((part, kind)).or_insert(next)
    }
}

/// The terms of a target while all other views are fixed: the sums over the other views.
struct Supports<'a> {
    each: Vec<Consistency<'a>>,
    keys: Vec<u64>,
}

impl ExtraTerms for Supports<'_> {
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        let add =
            |any, terms: &Consistency<'_>| terms.add_position(part, level, first, score) || any;
        self.each.iter().fold(false, add)
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        self.each.iter().map(|terms| terms.of_type(part, mixture)).sum()
    }

    fn max_gain(&self, part: usize) -> f32 {
        self.each.iter().map(|terms| terms.max_gain(part)).sum()
    }

    fn key(&self, part: usize) -> Option<u64> {
        Some(self.keys[part])
    }
}

/// The poses and the values of their terms.
struct State {
    poses: Vec<Pose>,
    own: Vec<f64>,
    /// Terms between two views, `[first][second]`; symmetric.
    between: Vec<Vec<f64>>,
}

impl State {
    fn new(own: Vec<f64>, poses: Vec<Pose>, pairs: &Pairs<'_>) -> Self {
        let n = poses.len();
        let value = |a: usize, b: usize| {
            if a == b {
                0.0
            } else {
                pairs.between(a, &poses[a], b, &poses[b])
            }
        };
        let between = (0..n).map(|a| (0..n).map(|b| value(a, b)).collect());
        Self {
            between: between.collect(),
            own,
            poses,
        }
    }

    fn energy(&self) -> f64 {
        let n = self.poses.len();
        let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b)));
        self.own.iter().sum::<f64>() + pairs.map(|(a, b)| self.between[a][b]).sum::<f64>()
    }

    /// Accepts a pose if it raises the energy that the view maximises.
    fn take_if_better(&mut self, view: usize, own: f64, pose: Pose, pairs: &Pairs<'_>) {
        let others = (0..self.poses.len()).filter(|other| *other != view);
        let gain = |pose: &Pose| -> f64 {
            let others = others.clone();
            let terms = others.map(|other| pairs.for_target(view, pose, other, &self.poses[other]));
            terms.sum()
        };
        if own + gain(&pose) > self.own[view] + gain(&self.poses[view]) {
            for other in others {
                let value = pairs.between(view, &pose, other, &self.poses[other]);
                self.between[other][view] = value;
                self.between[view][other] = value;
            }
            self.own[view] = own;
            self.poses[view] = pose;
        }
    }
}
