//! All views at once: one view is solved while every other one supports it, in turn until nothing moves.

use std::collections::BTreeMap;

use fmp::{ExtraTerms, IncrementalSolver, Pose, Responses, Solver};

use crate::consistency::{Consistency, PairTerms};
use crate::optimise::{is_best, mean_movement, types};
use crate::{Epipolar, Iteration, PairInput, Settings, TypeTables, ViewInput};

/// All views of one frame that answered.
#[derive(Clone, Copy)]
pub struct AllViewsInput<'a> {
    /// The views.
    pub views: &'a [ViewInput<'a>],
    /// Part-type tables of a pair `(first, second)` of indices into `views`, `first < second`.
    pub tables: &'a dyn Fn(usize, usize) -> Option<&'a TypeTables>,
    /// Weight of the terms of a pair. 1 adds those of all pairs as they are; `1 / (n - 1)` gives the
    /// supports of a view together as much weight as the one support of a pair has.
    pub weight: f64,
}

/// Where all views start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AllViewsStart<'a> {
    /// Candidate of every view.
    pub candidates: &'a [usize],
    /// Whether left and right of a view are exchanged with respect to the first.
    pub exchanged: &'a [bool],
}

/// What all views agreed on.
#[derive(Debug, Clone, PartialEq)]
pub struct AllViewsEstimate {
    /// The energy at the end.
    pub energy: f64,
    /// The way there; the target of each is an index into the views.
    pub iterations: Vec<Iteration>,
    /// Whether nothing moved any more at the end.
    pub converged: bool,
    /// Share of the consistency terms that were switched on, over all pairs and parts.
    pub active: f64,
    /// The pose in every view; parts as the model names them, not exchanged.
    pub poses: Vec<Pose>,
}

/// Maximises one energy over all views, from a given start.
///
/// The paper's eq. 3 with a sum over all views and all pairs of them,
/// `sum_v S(v) + weight sum_{v<u} (alpha xi + beta lambda)(v, u)`,
/// which its conclusion leaves for later work. One view is solved exactly while all others are fixed: its terms
/// are the sums of those that each other view alone would add, so the graph stays a tree. Views
/// take turns, those that are trusted least first, and a solution is taken only if the energy rises: it
/// never falls, and a cycle is impossible (but see [`SwitchBy::Support`](crate::SwitchBy::Support)). It ends when no view can raise the energy alone
/// (but for what `epsilon_px` lets pass), or after `max_iterations / 2` solutions of every view.
///
/// What it is worth, by PCP3D of `parallax eval` on 134 instants (three views, 14 of them four; the crate's page tells which), the mean of
/// the terms (a weight of `1 / (n - 1)`), two starts, against the mean of pairs: 73.3 against 71.0 by geometry, with 15 solutions of a
/// single view against 20 (four views: 23 against 40); 75.9 against 75.1 with the network's expected errors. The sum of the terms
/// (a weight of 1) 72.6, with 17 solutions (four views: 32). With an earlier model three views were better off in pairs (73.4
/// against 71.1), and where one of the four cameras was moved by two degrees they still are on these 14 instants (79.8 against 75.0 by geometry), but not on
/// all 70 frames (78.3 with types against 80.0), nor with the network (81.3 against 84.3).
///
/// A deployment asks for it by `views = "all"` in its section `[fuse]`, with the mean of the terms and two starts.
///
/// [`EnergyKind::Released`](crate::EnergyKind::Released) has no such form; the terms are the paper's.
///
/// * `evidence`: the responses of every view, where they lie; best with their bounds.
///
/// # Panics
///
/// If the lists are not of one length.
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
    let candidate = |(view, it): (&ViewInput<'_>, &usize)| view.candidates[*it].clone();
    let poses: Vec<Pose> = input
        .views
        .iter()
        .zip(start.candidates)
        .map(candidate)
        .collect();
    let own_score = |view: usize, pose: &Pose| f64::from(solver.score(evidence[view], pose, None));
    let own = poses
        .iter()
        .enumerate()
        .map(|(view, it)| own_score(view, it));
    let mut state = State::new(own.collect(), poses, &pairs);
    let order = order(input, &state.poses);
    let mut incremental: Vec<IncrementalSolver<'_>> =
        evidence.iter().map(|it| solver.incremental(it)).collect();
    let mut known: Vec<Known> = vec![Known::default(); n_views];
    let (mut iterations, mut converged) = (Vec::new(), n_views < 2);
    let mut calm = Calm::of(n_views);
    let most = (settings.max_iterations * n_views).div_ceil(2);
    for &target in order.iter().cycle().take(if converged { 0 } else { most }) {
        let supports = pairs.supports(target, &state.poses, &mut known[target]);
        let guesses = input.views[target].candidates.iter();
        let guesses = guesses.chain([&state.poses[target]]);
        let found = incremental[target].best(&supports, guesses);
        debug_assert!(is_best(solver, evidence[target], &supports, found.as_ref()));
        let before = state.poses[target].clone();
        if let Some(pose) = found {
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
        converged = calm.after(moved_px <= settings.epsilon_px && same_types);
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

/// Knows when no view can be moved any more.
struct Calm {
    n_views: usize,
    /// Solutions since the last that moved its view.
    n_still: usize,
    has_moved: bool,
}

impl Calm {
    fn of(n_views: usize) -> Self {
        Self {
            n_views,
            n_still: 0,
            has_moved: false,
        }
    }

    /// Counts a solution; returns whether it was the last that is needed.
    fn after(&mut self, is_still: bool) -> bool {
        self.n_still = if is_still { self.n_still + 1 } else { 0 };
        self.has_moved |= !is_still;
        // Who moved last was solved against all the others as they still are.
        self.n_still + usize::from(self.has_moved) >= self.n_views
    }
}

/// Views in the order in which they are solved: highest expected error first, or lowest score
/// where any view has no expectation; among equals the last.
fn order(input: &AllViewsInput<'_>, poses: &[Pose]) -> Vec<usize> {
    let expected = input.views.iter();
    let expected = expected.map(|it| it.sigma_px.map(|it| it.iter().sum::<f32>()));
    let trust: Vec<f32> = match expected.collect::<Option<Vec<f32>>>() {
        Some(errors) => errors.iter().map(|it| -it).collect(),
        None => poses.iter().map(|it| it.score).collect(),
    };
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_by(|&a, &b| trust[a].total_cmp(&trust[b]).then(b.cmp(&a)));
    order
}

/// All pairs: `[first][second - first - 1]`.
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

/// The terms of all pairs: `[first][second - first - 1]`.
struct Pairs<'a> {
    terms: Vec<Vec<PairTerms<'a>>>,
}

impl<'a> Pairs<'a> {
    fn new(settings: &'a Settings, inputs: &'a [Vec<PairInput<'a>>], exchanged: &[bool]) -> Self {
        let of_first = |(first, pairs): (usize, &'a Vec<PairInput<'a>>)| {
            let seconds = exchanged[first + 1..].iter();
            let terms = pairs.iter().zip(seconds);
            let terms =
                terms.map(|(pair, it)| PairTerms::new(settings, pair, *it != exchanged[first]));
            terms.collect()
        };
        Self {
            terms: inputs.iter().enumerate().map(of_first).collect(),
        }
    }

    /// The terms of two views, and the place of the first one given among them.
    fn of(&self, view: usize, other: usize) -> (&PairTerms<'a>, usize) {
        let (first, second) = (view.min(other), view.max(other));
        (
            &self.terms[first][second - first - 1],
            usize::from(view > other),
        )
    }

    /// The consistency sums of a pose of one view with the poses of another.
    fn between(&self, view: usize, pose: &Pose, other: usize, others: &Pose) -> f64 {
        match self.of(view, other) {
            (terms, 0) => terms.between(pose, others),
            (terms, _) => terms.between(others, pose),
        }
    }

    /// The same with the terms that are on while `view` is solved.
    fn for_target(&self, view: usize, pose: &Pose, other: usize, others: &Pose) -> f64 {
        match self.of(view, other) {
            (terms, 0) => terms.for_target(0, pose, others),
            (terms, side) => terms.for_target(side, others, pose),
        }
    }

    /// What all other views add to a target.
    fn supports<'b>(&'b self, target: usize, poses: &'b [Pose], known: &mut Known) -> Supports<'b> {
        let others = (0..poses.len()).filter(|it| *it != target);
        let one = |other: usize| {
            let (terms, side) = self.of(target, other);
            Consistency::new(terms, side, &poses[other])
        };
        let each: Vec<Consistency<'b>> = others.map(one).collect();
        let n_parts = poses[target].parts.len();
        let keys = (0..n_parts).map(|part| known.key(&each, part)).collect();
        Supports { each, keys }
    }

    fn active(&self) -> f64 {
        let all = self.terms.iter().flatten().flat_map(PairTerms::active);
        let (on, n) = all.fold((0, 0), |(on, n), it| (on + usize::from(it), n + 1));
        f64::from(on as u32) / f64::from(n.max(1))
    }
}

/// Numbers for what the terms of a part depend on: as that is more than a number holds, each kind that
/// comes up gets the next one.
#[derive(Debug, Clone, Default)]
struct Known {
    kinds: BTreeMap<(usize, Vec<Option<u64>>), u64>,
}

impl Known {
    fn key(&mut self, each: &[Consistency<'_>], part: usize) -> u64 {
        let next = self.kinds.len() as u64;
        let kind = each.iter().map(|it| it.key(part)).collect();
        *self.kinds.entry((part, kind)).or_insert(next)
    }
}

/// The terms of a target while all other views stand still: the sums of those of each.
struct Supports<'a> {
    each: Vec<Consistency<'a>>,
    keys: Vec<u64>,
}

impl ExtraTerms for Supports<'_> {
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool {
        let add = |any, it: &Consistency<'_>| it.add_position(part, level, first, score) || any;
        self.each.iter().fold(false, add)
    }

    fn of_type(&self, part: usize, mixture: usize) -> f32 {
        self.each.iter().map(|it| it.of_type(part, mixture)).sum()
    }

    fn max_gain(&self, part: usize) -> f32 {
        self.each.iter().map(|it| it.max_gain(part)).sum()
    }

    fn key(&self, part: usize) -> Option<u64> {
        Some(self.keys[part])
    }
}

/// The poses, and what they are worth.
struct State {
    poses: Vec<Pose>,
    own: Vec<f64>,
    /// `[first][second]`, symmetric.
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

    /// Takes a pose over if the energy rises, as the view sees it.
    fn take_if_better(&mut self, view: usize, own: f64, pose: Pose, pairs: &Pairs<'_>) {
        let others = (0..self.poses.len()).filter(|it| *it != view);
        let seen = |pose: &Pose| -> f64 {
            let others = others.clone();
            let terms = others.map(|it| pairs.for_target(view, pose, it, &self.poses[it]));
            terms.sum()
        };
        if own + seen(&pose) > self.own[view] + seen(&self.poses[view]) {
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
