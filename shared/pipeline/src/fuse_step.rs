//! The fusion step: pairs of views, each maximising its joint energy on evidence where it lies.

use std::sync::Arc;

use fmp::{Model, Pose, Responses, Solver};
use multiview::{
    Epipolar, PairEstimate, PairInput, PairStart, Settings, Start, TypeTables, ViewAnswer,
    ViewPlan, choose_start, estimate_pair,
};

/// What a view answered for one frame, besides its evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Distinct poses, best first; never empty.
    pub candidates: Vec<Pose>,
    /// Expected error of every part, pixels of the frame, if there is a prediction.
    pub sigma_px: Option<Vec<f32>>,
}

/// The fusion step for a rig.
#[derive(Debug)]
pub struct FuseStep {
    solver: Solver,
    settings: Settings,
    plans: Vec<Arc<ViewPlan>>,
    tables: Vec<(usize, usize, TypeTables)>,
}

/// What a pair found: one estimate per assumption about facing.
#[derive(Debug, Clone, PartialEq)]
pub struct PairAnswer {
    /// The two views, ascending.
    pub views: [usize; 2],
    /// Same facing, then opposite facing; the latter only where facing is to be decided.
    pub hypotheses: Vec<PairEstimate>,
}

impl FuseStep {
    /// Prepares the step.
    ///
    /// * `plans`: the views of the rig, in the rig's order.
    /// * `tables`: part-type tables of pairs `(first, second)` with `first < second`.
    pub fn new(
        model: Arc<Model>,
        settings: Settings,
        plans: Vec<Arc<ViewPlan>>,
        tables: Vec<(usize, usize, TypeTables)>,
    ) -> Self {
        Self {
            solver: Solver::new(model),
            settings,
            plans,
            tables,
        }
    }

    /// The joint start of a frame; `None` for the views that gave no answer.
    ///
    /// Every fusion worker computes it for all views, from their (small) answers alone, so that all
    /// pairs start from the same person.
    pub fn start(&self, answers: &[Option<Answer>]) -> Vec<Option<(usize, bool)>> {
        let present: Vec<usize> = (0..answers.len())
            .filter(|it| answers[*it].is_some())
            .collect();
        if present.is_empty() {
            return vec![None; answers.len()];
        }
        let views: Vec<ViewAnswer<'_>> = present
            .iter()
            .filter_map(|&view| Some(self.view_answer(view, answers[view].as_ref()?)))
            .collect();
        let tables = |first: usize, second: usize| self.tables(present[first], present[second]);
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

    /// Solves one pair from the joint start.
    ///
    /// * Returns `None` if either view gave no answer.
    pub fn pair(
        &self,
        views: [usize; 2],
        answers: &[Option<Answer>],
        evidence: [&Responses<'_>; 2],
        start: &[Option<(usize, bool)>],
    ) -> Option<PairAnswer> {
        let [first, second] = views;
        let input = PairInput {
            views: [
                self.view_answer(first, answers[first].as_ref()?),
                self.view_answer(second, answers[second].as_ref()?),
            ],
            epipolar: Epipolar::new(&self.plans[first], &self.plans[second]),
            tables: self.tables(first, second),
        };
        let (candidate_a, exchanged_a) = start[first]?;
        let (candidate_b, exchanged_b) = start[second]?;
        let bounds = evidence.map(|it| match it.bounds() {
            Some(_) => None,
            None => Some(self.solver.bounds(it)),
        });
        let evidence = [0, 1].map(|it| match &bounds[it] {
            Some(bounds) => evidence[it].with_bounds(bounds),
            None => *evidence[it],
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
        Some(PairAnswer { views, hypotheses })
    }

    fn view_answer<'a>(&'a self, view: usize, answer: &'a Answer) -> ViewAnswer<'a> {
        ViewAnswer {
            plan: &self.plans[view],
            candidates: &answer.candidates,
            sigma_px: answer.sigma_px.as_deref(),
        }
    }

    fn tables(&self, first: usize, second: usize) -> Option<&TypeTables> {
        self.tables
            .iter()
            .find(|it| (it.0, it.1) == (first, second))
            .map(|it| &it.2)
    }
}

/// All pairs of `n_views` views, ascending.
pub fn all_pairs(n_views: usize) -> Vec<[usize; 2]> {
    (0..n_views)
        .flat_map(|first| (first + 1..n_views).map(move |second| [first, second]))
        .collect()
}
