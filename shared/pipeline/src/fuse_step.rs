//! The fusion step: maximises the joint energy of pairs of views, or of all views. It reads the evidence without copying it.

use std::sync::Arc;

use fmp::{Model, Responses, Solver};
use multiview::{
    AllViewsEstimate, AllViewsInput, AllViewsStart, AngleTables, Epipolar, Exchanges, PairEstimate,
    PairInput, PairStart, Settings, Start, TypeTables, ViewInput, ViewPlan, angle_between,
    choose_start, estimate_all_views, estimate_pair, is_exchanged, rank_starts,
};

use crate::following::Others;
use crate::fused_view::{Candidate, FusedView};
use crate::skeleton_settings::SkeletonSettings;
use crate::space::Space;
use crate::view_result::ViewResult;

/// The part-type tables of a rig.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PairTables {
    /// Tables of pairs `(first, second)` of views with `first < second`.
    pub of_pairs: Vec<(usize, usize, TypeTables)>,
    /// Tables for all other pairs, by the angle between the views at the person.
    pub by_angle: Option<Arc<AngleTables>>,
}

/// The fusion step for a rig.
#[derive(Debug)]
pub struct FuseStep {
    solver: Solver,
    settings: Settings,
    plans: Vec<Arc<ViewPlan>>,
    tables: PairTables,
    space: Space,
}

/// The result of a pair: one estimate for each assumption about whether both views see the person from the same side.
#[derive(Debug, Clone, PartialEq)]
pub struct PairResult {
    /// The two views, in ascending order.
    pub views: [usize; 2],
    /// The estimate for two views that see the person from the same side, then the one for opposite sides. The second exists only if this
    /// must be decided.
    pub hypotheses: Vec<PairEstimate>,
}

/// Number of assumptions about front and back views that are judged in 3D; the ones with the highest energies are taken.
const N_RANKED: usize = 32;

/// Number of assumptions about front and back views that are tried with all views at once; the message of a pair also has room for this
/// many.
const N_STARTS: usize = 2;

/// Number of views of a frame that are solved together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Views {
    /// Views are solved in pairs whose poses are then combined: the paper's method.
    Pairs,
    /// All views are solved at once; each view is supported by the mean of the terms of all others.
    #[default]
    All,
}

/// Weight of the terms of a pair if all views are solved at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// Each pair has weight 1: the terms of the other views add up.
    Sum,
    /// The other views together have the same weight as the single other view of a pair.
    Mean,
}

/// The result of all views at once.
#[derive(Debug, Clone, PartialEq)]
pub struct AllViewsResult {
    /// The views with a result, in ascending order.
    pub views: Vec<usize>,
    /// One estimate for each assumption about which views see the person from behind; never empty.
    pub hypotheses: Vec<AllViewsHypothesis>,
}

/// The result of all views at once under one assumption about which views see the person from behind.
#[derive(Debug, Clone, PartialEq)]
pub struct AllViewsHypothesis {
    /// For each view, true if its left and right are assumed to be swapped relative to the first view.
    pub exchanged: Vec<bool>,
    /// The candidate of each view from which the solution started.
    pub candidates: Vec<usize>,
    /// The result; its lists are indexed like `views`.
    pub estimate: AllViewsEstimate,
}

impl AllViewsResult {
    /// Drops the views that `keep` rejects; `None` if fewer than two are left.
    pub fn only(mut self, keep: impl Fn(usize) -> bool) -> Option<Self> {
        let kept: Vec<usize> = (0..self.views.len()).filter(|idx| keep(self.views[*idx])).collect();
        if kept.len() < 2 {
            return None;
        }
        self.views = kept.iter().map(|idx| self.views[*idx]).collect();
        for hypothesis in &mut self.hypotheses {
            hypothesis.exchanged = kept.iter().map(|idx| hypothesis.exchanged[*idx]).collect();
            let candidates = kept.iter().map(|idx| hypothesis.candidates[*idx]);
            hypothesis.candidates = candidates.collect();
            let poses = &hypothesis.estimate.poses;
            hypothesis.estimate.poses = kept.iter().map(|idx| poses[*idx].clone()).collect();
        }
        Some(self)
    }
}

impl FuseStep {
    /// Prepares the step.
    ///
    /// * `plans`: the views of the rig, in the rig's order.
    pub fn new(
        model: Arc<Model>,
        settings: Settings,
        plans: Vec<Arc<ViewPlan>>,
        tables: PairTables,
    ) -> Self {
        let space = Space {
            plans: plans.clone(),
            up_in_world: None,
            settings: SkeletonSettings::default(),
        };
        Self {
            solver: Solver::new(model),
            settings,
            plans,
            tables,
            space,
        }
    }

    /// Returns the number of levels solved so far ([`Solver::n_sweeps`]); another thread may read it.
    pub fn n_sweeps(&self) -> u64 {
        self.solver.n_sweeps()
    }

    /// Returns the common start of all views of a frame; `None` for views without a result.
    ///
    /// Every fusion worker computes this start for all views. The computation needs only the single-view results, which are small. So all
    /// pairs start from the same person.
    ///
    /// * `others`: candidates that show other people ([`Following::others`](crate::Following::others)).
    pub fn start(
        &self,
        answers: &[Option<ViewResult>],
        others: &Others,
    ) -> Vec<Option<(usize, bool)>> {
        let present: Vec<usize> = (0..answers.len())
            .filter(|view| answers[*view].is_some() && !others.only(*view))
            .collect();
        if present.is_empty() {
            return vec![None; answers.len()];
        }
        let views: Vec<ViewInput<'_>> = present
            .iter()
            .filter_map(|&view| Some(self.view_answer(view, answers[view].as_ref()?, others)))
            .collect();
        let tables = |first: usize, second: usize| {
            let pair = [present[first], present[second]];
            self.tables(pair, [&views[first], &views[second]])
        };
        let Start {
            candidates,
            exchanged,
            ..
        } = choose_start(&self.settings, &views, &tables);
        let mut start = vec![None; answers.len()];
        for (i, &view) in present.iter().enumerate() {
            start[view] = Some((candidates[i], exchanged[i]));
        }
        start
    }

    /// Solves one pair from the common start of all views.
    ///
    /// * Returns `None` if either view has no result, or if the evidence of either view does not
    ///   [cover](Responses::covers) its poses.
    pub fn pair(
        &self,
        views: [usize; 2],
        answers: &[Option<ViewResult>],
        evidence: [&Responses<'_>; 2],
        start: &[Option<(usize, bool)>],
    ) -> Option<PairResult> {
        let [first, second] = views;
        for (view, evidence) in views.into_iter().zip(evidence) {
            if !answers[view].as_ref()?.is_within(evidence) {
                return None;
            }
        }
        // The start is already chosen.
        let others = Others::default();
        let each = [
            self.view_answer(first, answers[first].as_ref()?, &others),
            self.view_answer(second, answers[second].as_ref()?, &others),
        ];
        let input = PairInput {
            views: each,
            epipolar: Epipolar::new(&self.plans[first], &self.plans[second]),
            tables: self.tables(views, each.each_ref()),
        };
        let (candidate_a, exchanged_a) = start[first]?;
        let (candidate_b, exchanged_b) = start[second]?;
        let bounds = evidence.map(|evidence| match evidence.bounds() {
            Some(_) => None,
            None => Some(self.solver.bounds(evidence)),
        });
        let evidence = [0, 1].map(|side| match &bounds[side] {
            Some(bounds) => evidence[side].with_bounds(bounds),
            None => *evidence[side],
        });
        let hypothesis = |exchanged: bool| {
            let start = PairStart {
                candidates: [candidate_a, candidate_b],
                exchanged,
            };
            estimate_pair(
                &self.solver,
                &self.settings,
                &input,
                evidence.each_ref(),
                start,
            )
        };
        let mirrored = self.plans[first].model().spec().mirror.is_some();
        let hypotheses = if self.settings.facing && mirrored {
            vec![hypothesis(false), hypothesis(true)]
        } else {
            vec![hypothesis(exchanged_a != exchanged_b)]
        };
        Some(PairResult { views, hypotheses })
    }

    /// Solves all views at once, from the best starting poses under different assumptions about which views see the person from behind.
    ///
    /// * `evidence`: evidence of the views with a result; it should include its bounds.
    /// * `others`: candidates that show other people ([`Following::others`](crate::Following::others)).
    /// * Returns `None` if fewer than two views have a result whose poses are [covered](Responses::covers)
    ///   by their evidence.
    pub fn all_views(
        &self,
        answers: &[Option<ViewResult>],
        evidence: &[Option<Responses<'_>>],
        others: &Others,
        support: Support,
    ) -> Option<AllViewsResult> {
        let present = |view: &usize| {
            let both = answers[*view].as_ref().zip(evidence[*view].as_ref());
            both.is_some_and(|(answer, evidence)| answer.is_within(evidence)) && !others.only(*view)
        };
        let present: Vec<usize> = (0..answers.len()).filter(present).collect();
        if present.len() < 2 {
            return None;
        }
        let views = present.iter();
        let views =
            views.filter_map(|&view| Some(self.view_answer(view, answers[view].as_ref()?, others)));
        let views: Vec<ViewInput<'_>> = views.collect();
        let evidence = present.iter().filter_map(|&view| evidence[view].as_ref());
        let evidence: Vec<&Responses<'_>> = evidence.collect();
        let input = AllViewsInput {
            views: &views,
            tables: &|first, second| {
                let pair = [present[first], present[second]];
                self.tables(pair, [&views[first], &views[second]])
            },
            weight: match support {
                Support::Sum => 1.0,
                Support::Mean => 1.0 / (present.len() - 1) as f64,
            },
        };
        let starts = rank_starts(&self.settings, &views, input.tables);
        let starts = self.most_likely(starts, &present, answers);
        let solve = |start: Start| {
            let from = AllViewsStart {
                candidates: &start.candidates,
                exchanged: &start.exchanged,
            };
            AllViewsHypothesis {
                estimate: estimate_all_views(&self.solver, &self.settings, &input, &evidence, from),
                exchanged: start.exchanged,
                candidates: start.candidates,
            }
        };
        Some(AllViewsResult {
            hypotheses: starts.into_iter().map(solve).collect(),
            views: present,
        })
    }

    /// Returns the most likely starts, judged by their energies, by how well the views agree in 3D, and by the views' evidence of the
    /// direction in which the person faces.
    ///
    /// * `starts`: the starts, highest energy first.
    fn most_likely(
        &self,
        mut starts: Vec<Start>,
        present: &[usize],
        answers: &[Option<ViewResult>],
    ) -> Vec<Start> {
        starts.truncate(N_RANKED);
        if starts.len() > N_STARTS && self.space.can_exchange() {
            let score = |start: &Start| {
                let views = self.start_views(start, present, answers);
                // The energy of a start counts every view once for each other view.
                let of_one = start.energy / (present.len() - 1).max(1) as f64;
                of_one + self.space.judge(answers, &views).score
            };
            let mut scored: Vec<(f64, Start)> =
                starts.into_iter().map(|start| (score(&start), start)).collect();
            scored.sort_by(|a, b| b.0.total_cmp(&a.0));
            starts = scored.into_iter().map(|scored| scored.1).collect();
        }
        starts.truncate(N_STARTS);
        starts
    }

    /// Returns the candidates of a start, with parts named by the person's left and right; one entry for each view of the rig.
    fn start_views(
        &self,
        start: &Start,
        present: &[usize],
        answers: &[Option<ViewResult>],
    ) -> Vec<Option<FusedView>> {
        let exchanges = present
            .iter()
            .zip(&start.exchanged)
            .fold(0, |mask, (view, it)| mask | Exchanges::from(*it) << view);
        let mut views = vec![None; self.plans.len()];
        for (&view, &candidate) in present.iter().zip(&start.candidates) {
            let pose = answers[view].as_ref().map(|answer| &answer.candidates[candidate]);
            views[view] = pose.map(|pose| {
                let mirror = self.space.mirror(view, exchanges);
                let start =
                    Candidate::of_pose(pose, f64::from(pose.score), &self.plans[view], mirror);
                start.alone(is_exchanged(exchanges, view))
            });
        }
        views
    }

    fn view_answer<'a>(
        &'a self,
        view: usize,
        answer: &'a ViewResult,
        others: &Others,
    ) -> ViewInput<'a> {
        ViewInput {
            plan: &self.plans[view],
            candidates: &answer.candidates,
            others: others.of_view(view),
            sigma_px: answer.sigma_px.as_deref(),
            tau_px: answer.tau_px.as_deref(),
        }
    }

    /// Returns the tables of a pair: its own tables, or the tables for the angle between the views at the person.
    fn tables(&self, pair: [usize; 2], views: [&ViewInput<'_>; 2]) -> Option<&TypeTables> {
        let mut own = self.tables.of_pairs.iter();
        if let Some(own) = own.find(|table| [table.0, table.1] == pair) {
            return Some(&own.2);
        }
        let by_angle = self.tables.by_angle.as_ref()?;
        by_angle.at(angle_between(views[0], views[1])?)
    }
}

/// Returns all pairs of `n_views` views, in ascending order.
pub fn all_pairs(n_views: usize) -> Vec<[usize; 2]> {
    (0..n_views)
        .flat_map(|first| (first + 1..n_views).map(move |second| [first, second]))
        .collect()
}
