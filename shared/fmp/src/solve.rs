//! Finds the exact best tree by max-sum message passing from the leaves to the root, followed by backtracking.

mod bounds;
mod distinct;
mod incremental;
mod statistics;
mod suppress;
mod sweep;

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use kernels::{Isa, MessageRule};
use rayon::prelude::*;

use self::statistics::Tally;
use self::sweep::{Problem, Sweep, Workspace};
use crate::pool::{Pool, in_pool, lock};
use crate::{Edge, Model, Pose, Responses, Spring, Springs};
pub use incremental::IncrementalSolver;
pub use statistics::SolveStatistics;

/// Terms that another view adds to the score of a part (the `xi` and `lambda` of eq. 3).
///
/// Each part may have either term, both or none; a part without terms is scored by this view alone.
pub trait ExtraTerms: Sync {
    /// Adds this part's position term, which is the same for every type, to the scores of some cells.
    ///
    /// Returns `false` and leaves `score` unchanged if the part has no position term.
    ///
    /// * `score`: scores of the cells of the level starting at `first`, in row-major order. The term of a cell must not depend on which
    ///   other cells are requested.
    fn add_position(&self, part: usize, level: usize, first: usize, score: &mut [f32]) -> bool;

    /// Returns the score that is added to every placement of the part with this type.
    fn of_type(&self, part: usize, mixture: usize) -> f32;

    /// Returns an upper bound of the sum of both terms for any placement of the part. The
    /// [`IncrementalSolver`] uses it to prune levels and poses. The bound is infinite if it is unknown.
    fn max_gain(&self, _part: usize) -> f32 {
        f32::INFINITY
    }

    /// Returns a key for everything that determines the part's terms and can change during the life of an [`IncrementalSolver`]. Equal keys
    /// mean equal terms. `None` means that the terms can change at any time.
    fn key(&self, _part: usize) -> Option<u64> {
        None
    }
}

/// Settings that select the placements returned by [`Solver::candidates`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateSettings {
    /// Minimum score of a candidate, in the unit of the model's scores.
    pub threshold: f32,
    /// Maximum fraction of a selected candidate's box that a later candidate may cover, from 0 to 1.
    pub overlap: f64,
    /// Maximum number of poses to return.
    pub max: usize,
}

/// Finds the best tree for given evidence. Stores the prepared model and reusable workspaces.
///
/// The score of a part is `(response + position term) + type term`. The messages of its children
/// are added in descending order of the children, each as `((child + vertical) + horizontal) + bias`,
/// and the root bias comes last, all in single precision.
///
/// Inside a rayon pool, the levels are distributed over its threads; elsewhere, the work stays on the
/// caller's thread. The results are the same.
#[derive(Debug)]
pub struct Solver {
    model: Arc<Model>,
    isa: Isa,
    /// The message rule of every part; `None` for the root.
    rules: Vec<Option<MessageRule>>,
    /// For each part, the number of score planes before those of the part; the last entry is the total number.
    first_planes: Vec<usize>,
    /// This is a list instead of a [`Pool`], because the best-fitting workspace for a level is taken, and a queue cannot be searched for
    /// it.
    workspaces: Mutex<Vec<Workspace>>,
    /// One list of part scores for every caller of [`Self::score`].
    scores: Pool<Vec<f32>>,
    tally: Tally,
    n_sweeps: AtomicU64,
}

/// A placement of the root and the score of its best tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// The score, with the root bias.
    pub score: f32,
    /// Level of the pyramid.
    pub level: u16,
    /// Row among the searched cells of the level.
    pub y: usize,
    /// Column among the searched cells of the level.
    pub x: usize,
    /// Type of the root.
    pub mixture: usize,
}

impl Solver {
    /// Prepares the solver for `model`.
    pub fn new(model: Arc<Model>) -> Self {
        Self::on(Isa::best(), model)
    }

    /// Like [`Self::new`], for a given instruction set; the results are the same on all instruction sets.
    pub fn on(isa: Isa, model: Arc<Model>) -> Self {
        let rule_of = |part: usize| {
            let edge = model.spec().parts[part].edge.as_ref()?;
            Some(rule(edge, model.n_types(edge.parent), model.n_types(part)))
        };
        let mut first_planes = vec![0];
        for part in 0..model.n_parts() {
            first_planes.push(first_planes[part] + model.n_types(part));
        }
        Self {
            rules: (0..model.n_parts()).map(rule_of).collect(),
            first_planes,
            isa,
            model,
            workspaces: Mutex::default(),
            scores: Pool::default(),
            tally: Tally::default(),
            n_sweeps: AtomicU64::new(0),
        }
    }

    /// Returns the model of the solver.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Returns the best pose over the levels that have responses, including the extra terms if there are any.
    ///
    /// The result is the exact best among the poses whose parts are all on cells with values. Ties of the root go to the lower level, then
    /// to the first cell in row-major order, then to the lower type (the reference programs leave the first two open). Ties of a child go
    /// to the lower type, then to the first column, then to the first row. Returns `None` if no level has responses, or if no pose is
    /// possible.
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model.
    pub fn best(&self, evidence: &Responses<'_>, extra: Option<&dyn ExtraTerms>) -> Option<Pose> {
        self.best_on(evidence, evidence.levels(), extra)
    }

    /// Like [`Self::best`], but only over some levels; levels without responses are left out.
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model.
    pub fn best_on(
        &self,
        evidence: &Responses<'_>,
        levels: &[u16],
        extra: Option<&dyn ExtraTerms>,
    ) -> Option<Pose> {
        self.check(evidence);
        let search = Search {
            solver: self,
            evidence,
            extra,
            tally: None,
            best: Mutex::new(None),
        };
        let run = |&level: &u16| {
            if evidence.levels().binary_search(&level).is_ok() {
                let bytes = Problem::new(self, evidence, extra, level).bytes();
                let put_back = |_: u16, it: Workspace| self.put_back(it);
                search.solve_level(level, f64::INFINITY, self.workspace(bytes), &put_back);
            }
        };
        if in_pool() {
            levels.par_iter().for_each(run);
        } else {
            levels.iter().for_each(run);
        }
        search.finish(&|_, it| self.put_back(it))
    }

    /// Returns the score of the best tree at every cell of the root, `rows x cols` of
    /// [`Responses::window`].
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model, or `level` is not a level of its layout.
    pub fn root_scores(
        &self,
        evidence: &Responses<'_>,
        level: u16,
        extra: Option<&dyn ExtraTerms>,
    ) -> Vec<f32> {
        let sweeps = self.sweep_levels(evidence, &[level], extra, |sweep| {
            sweep.roots().map(|root| root.score).collect()
        });
        sweeps.into_iter().next().unwrap_or_default()
    }

    /// Returns the score of a given pose, summed in the order of the messages.
    ///
    /// For a pose that this solver returned from the same evidence and terms, it equals the pose's
    /// score bit for bit.
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model, or does not [cover](Responses::covers) the pose.
    pub fn score(
        &self,
        evidence: &Responses<'_>,
        pose: &Pose,
        extra: Option<&dyn ExtraTerms>,
    ) -> f32 {
        self.check(evidence);
        let problem = Problem::new(self, evidence, extra, pose.level);
        let mut scores = self.scores.take();
        let score = sweep::score(&problem, pose, &mut scores);
        self.scores.put_back(scores);
        score
    }

    /// Returns the counters of all incremental solutions so far.
    pub fn statistics(&self) -> SolveStatistics {
        self.tally.sums()
    }

    /// Returns the number of levels on which messages have been computed so far, in solutions of any kind, including unfinished ones. The
    /// number shows the progress of long computations, and may be read from another thread.
    pub fn n_sweeps(&self) -> u64 {
        self.n_sweeps.load(Ordering::Relaxed)
    }

    /// Returns the planes of a part.
    fn planes(&self, part: usize) -> Range<usize> {
        self.first_planes[part]..self.first_planes[part + 1]
    }

    fn root_bias(&self) -> f32 {
        self.model.spec().root_bias as f32
    }

    /// Returns the workspace that fits `bytes` of planes most closely; the largest one if none is large enough.
    fn workspace(&self, bytes: usize) -> Workspace {
        let mut pool = lock(&self.workspaces);
        let fit = |workspace: &Workspace| {
            let held = workspace.bytes();
            (held < bytes, held.abs_diff(bytes))
        };
        let closest = (0..pool.len()).min_by_key(|&i| fit(&pool[i]));
        let mut found =
            closest.map_or_else(Workspace::default, |closest| pool.swap_remove(closest));
        found.forget();
        found
    }

    fn put_back(&self, workspace: Workspace) {
        lock(&self.workspaces).push(workspace);
    }

    fn check(&self, evidence: &Responses<'_>) {
        assert_eq!(
            evidence.layout().n_filters,
            self.model.n_filters(),
            "evidence of this model"
        );
    }

    /// Computes all messages on every level of `levels` that has responses, and calls `answer` for each.
    fn sweep_levels<T: Send>(
        &self,
        evidence: &Responses<'_>,
        levels: &[u16],
        extra: Option<&dyn ExtraTerms>,
        answer: impl Fn(&Sweep<'_>) -> T + Sync,
    ) -> Vec<T> {
        self.check(evidence);
        let run = |&level: &u16| {
            evidence.levels().binary_search(&level).ok()?;
            let problem = Problem::new(self, evidence, extra, level);
            let mut workspace = self.workspace(problem.bytes());
            let answered = answer(&Sweep::run(&problem, &mut workspace));
            self.put_back(workspace);
            Some(answered)
        };
        if in_pool() {
            levels.par_iter().filter_map(run).collect()
        } else {
            levels.iter().filter_map(run).collect()
        }
    }
}

/// A search for the best root over several levels, which may be solved in any order and in parallel.
struct Search<'a> {
    solver: &'a Solver,
    evidence: &'a Responses<'a>,
    extra: Option<&'a dyn ExtraTerms>,
    /// Counters of the work, if the work is counted.
    tally: Option<&'a Tally>,
    /// The best root so far, and the workspace that contains the tree of this root.
    best: Mutex<Option<(Root, Workspace)>>,
}

/// A function that puts the workspace of a level back.
type PutBack<'a> = dyn Fn(u16, Workspace) + Sync + 'a;

impl Search<'_> {
    /// Returns the score of the best root so far.
    fn score(&self) -> f32 {
        let best = lock(&self.best);
        best.as_ref().map_or(f32::NEG_INFINITY, |best| best.0.score)
    }

    /// Returns true if a root with this score on this level would be the best so far.
    fn wins(&self, score: f32, level: u16) -> bool {
        let best = lock(&self.best);
        let beats = |(root, _): &(Root, Workspace)| {
            score > root.score || (score == root.score && level < root.level)
        };
        score > f32::NEG_INFINITY && best.as_ref().is_none_or(beats)
    }

    /// Solves a level.
    ///
    /// * `slack`: see [`Problem::with_slack`].
    fn solve_level(
        &self,
        level: u16,
        slack: f64,
        mut workspace: Workspace,
        put_back: &PutBack<'_>,
    ) {
        let problem = Problem::new(self.solver, self.evidence, self.extra, level);
        let problem = problem.with_slack(slack);
        let sweep = Sweep::run(&problem, &mut workspace);
        if let Some(tally) = self.tally {
            tally.solved(problem.n_entries(), sweep.n_computed());
        }
        let root = if self.wins(sweep.highest(), level) {
            sweep.best_root()
        } else {
            None
        };
        let Some(root) = root else {
            return put_back(level, workspace);
        };
        let mut best = lock(&self.best);
        let beaten = |(best, _): &(Root, Workspace)| root.best_first(best).is_lt();
        let loser = if best.as_ref().is_none_or(beaten) {
            best.replace((root, workspace)).map(|(root, of)| (root.level, of))
        } else {
            Some((level, workspace))
        };
        drop(best);
        if let Some((level, workspace)) = loser {
            put_back(level, workspace);
        }
    }

    /// Returns the pose of the best tree.
    fn finish(self, put_back: &PutBack<'_>) -> Option<Pose> {
        let best = self.best.into_inner();
        let (root, workspace) = best.unwrap_or_else(PoisonError::into_inner)?;
        let problem = Problem::new(self.solver, self.evidence, self.extra, root.level);
        let pose = Sweep::of(&problem, &workspace).backtrack(root);
        put_back(root.level, workspace);
        pose
    }
}

/// Returns the message rule of the child of `edge`.
fn rule(edge: &Edge, n_parent_types: usize, n_types: usize) -> MessageRule {
    let spring = |spring: &Spring| kernels::Spring {
        w: spring.w,
        anchor: spring.anchor,
    };
    let mut springs = Vec::new();
    let mut choices = vec![Vec::new(); n_parent_types];
    match &edge.springs {
        Springs::PerChildType(of_type) => {
            springs.extend(of_type.iter().map(spring).enumerate());
            for (l, choices) in choices.iter_mut().enumerate() {
                choices.extend((0..n_types).map(|k| (k, edge.bias[l][k] as f32)));
            }
        }
        Springs::PerTypePair(of_pair) => {
            for (l, of_type) in of_pair.iter().enumerate() {
                for (k, it) in of_type.iter().enumerate() {
                    if let Some(it) = it {
                        choices[l].push((springs.len(), edge.bias[l][k] as f32));
                        springs.push((k, spring(it)));
                    }
                }
            }
        }
    }
    MessageRule::new(n_types, springs, choices)
}
