//! The exact solution of the tree: votes from the leaves to the root, then back.

mod distinct;
mod suppress;
mod sweep;

use std::sync::{Arc, Mutex};

use kernels::{Isa, VoteRule};
use rayon::prelude::*;

use self::sweep::{Sweep, Workspace};
use crate::extract::{in_pool, lock};
use crate::{Edge, Model, Pose, Responses, Spring, Springs};

/// Terms that another view adds to the score of a part (the `xi` and `lambda` of eq. 3).
///
/// Both are optional per part; a part without them is scored by this view alone.
pub trait Extra: Sync {
    /// Adds this part's position term to `score`, `rows x cols` of the level, the same for every type.
    ///
    /// Returns `false`, and leaves `score` alone, if the part has none.
    fn add_position(&self, part: usize, level: usize, score: &mut [f32]) -> bool;

    /// Score added to every placement of this type of the part.
    fn of_type(&self, part: usize, mixture: usize) -> f32;
}

/// Which placements [`Solver::candidates`] returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidateSettings {
    /// Lowest score of a candidate, in the unit of the model's scores.
    pub threshold: f32,
    /// Largest share of a picked candidate's box that a later one may cover, 0..1.
    pub overlap: f64,
    /// Most poses to return.
    pub max: usize,
}

/// Solves one tree on given evidence. Holds what can be prepared once per model, and the workspaces
/// that are used again from solution to solution.
///
/// The score of a part is `(response + position term) + type term`; the votes of its children are
/// added to it in descending order of the children, each `((child + vertical) + horizontal) + bias`,
/// and the root bias comes last, all in single precision.
///
/// Inside a rayon pool the levels are spread over its threads, elsewhere the work stays on the
/// caller's; the answers are the same.
#[derive(Debug)]
pub struct Solver {
    model: Arc<Model>,
    isa: Isa,
    /// How every part votes; `None` for the root.
    rules: Vec<Option<VoteRule>>,
    workspaces: Mutex<Vec<Workspace>>,
}

/// A placement of the root and the score of the best tree that hangs on it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Root {
    score: f32,
    level: u16,
    y: usize,
    x: usize,
    mixture: usize,
}

impl Solver {
    /// Prepares `model`.
    pub fn new(model: Arc<Model>) -> Self {
        Self::on(Isa::best(), model)
    }

    /// As [`Self::new`], for a given instruction set; the answers are the same on all.
    pub fn on(isa: Isa, model: Arc<Model>) -> Self {
        let rule_of = |part: usize| {
            let edge = model.spec().parts[part].edge.as_ref()?;
            Some(rule(edge, model.n_types(edge.parent), model.n_types(part)))
        };
        Self {
            rules: (0..model.n_parts()).map(rule_of).collect(),
            isa,
            model,
            workspaces: Mutex::default(),
        }
    }

    /// The model that is solved.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The best pose over the offered levels, with the extra terms if there are any.
    ///
    /// Exact. Ties of the root go to the lower level, then to the first cell in row-major order,
    /// then to the lower type (the reference programs leave the first two open); ties of a child to
    /// the lower type, then to the first column, then to the first row. `None` if no level is
    /// offered, or no pose is possible.
    ///
    /// # Panics
    ///
    /// If the evidence is another model's.
    pub fn best(&self, evidence: &Responses<'_>, extra: Option<&dyn Extra>) -> Option<Pose> {
        self.best_on(evidence, evidence.levels(), extra)
    }

    /// [`Self::best`] over some levels; those that are not offered are left out.
    ///
    /// # Panics
    ///
    /// If the evidence is another model's.
    pub fn best_on(
        &self,
        evidence: &Responses<'_>,
        levels: &[u16],
        extra: Option<&dyn Extra>,
    ) -> Option<Pose> {
        let highest = Mutex::new(f32::NEG_INFINITY);
        let poses = self.sweep_levels(evidence, levels, extra, |sweep| {
            let root = sweep.best_root()?;
            let mut highest = lock(&highest);
            if root.score < *highest {
                return None;
            }
            *highest = root.score;
            drop(highest);
            sweep.backtrack(root)
        });
        let better = |a: Pose, b: Pose| {
            let wins = b.score > a.score || (b.score == a.score && b.level < a.level);
            if wins { b } else { a }
        };
        poses.into_iter().flatten().reduce(better)
    }

    /// The score of the best tree at every cell of the root, `rows x cols` of the level.
    ///
    /// # Panics
    ///
    /// If the evidence is another model's, or `level` is not a level of its layout.
    pub fn root_scores(
        &self,
        evidence: &Responses<'_>,
        level: u16,
        extra: Option<&dyn Extra>,
    ) -> Vec<f32> {
        let sweeps = self.sweep_levels(evidence, &[level], extra, |sweep| {
            sweep.roots().map(|it| it.score).collect()
        });
        sweeps.into_iter().next().unwrap_or_default()
    }

    /// The score of a given pose, summed in the order in which the votes would be.
    ///
    /// For a pose that this solver returned from the same evidence and terms, it is the pose's
    /// score bit for bit.
    ///
    /// # Panics
    ///
    /// If the evidence is another model's, or the pose does not lie on its level.
    pub fn score(&self, evidence: &Responses<'_>, pose: &Pose, extra: Option<&dyn Extra>) -> f32 {
        self.check(evidence);
        sweep::score(self, evidence, pose, extra)
    }

    fn check(&self, evidence: &Responses<'_>) {
        assert_eq!(
            evidence.layout().n_filters,
            self.model.n_filters(),
            "evidence of this model"
        );
    }

    /// Casts all votes on every one of `levels` that is offered, and asks `answer` about each.
    fn sweep_levels<T: Send>(
        &self,
        evidence: &Responses<'_>,
        levels: &[u16],
        extra: Option<&dyn Extra>,
        answer: impl Fn(&Sweep<'_>) -> T + Sync,
    ) -> Vec<T> {
        self.check(evidence);
        let run = |&level: &u16| {
            evidence.levels().binary_search(&level).ok()?;
            let mut workspace = lock(&self.workspaces).pop().unwrap_or_default();
            let answered = answer(&Sweep::run(self, evidence, level, extra, &mut workspace));
            lock(&self.workspaces).push(workspace);
            Some(answered)
        };
        if in_pool() {
            levels.par_iter().filter_map(run).collect()
        } else {
            levels.iter().filter_map(run).collect()
        }
    }
}

/// How the child of `edge` votes.
fn rule(edge: &Edge, n_parent_types: usize, n_types: usize) -> VoteRule {
    let spring = |it: &Spring| kernels::Spring {
        w: it.w,
        anchor: it.anchor,
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
    VoteRule::new(n_types, springs, choices)
}
