//! The same evidence solved again and again, under terms that change little from time to time.

use std::sync::Mutex;

use rayon::prelude::*;

use super::sweep::{Problem, Workspace};
use super::{Bounds, Extra, Search, Solver};
use crate::extract::{in_pool, lock};
use crate::{Pose, Responses};

/// Most memory of score planes that is kept from one solution to the next, bytes.
const ROOM: usize = 64 << 20;

/// Solves one view's evidence repeatedly, as the other views' terms change.
///
/// The answers are those of [`Solver::best`], bit for bit, from less work: levels that cannot hold the
/// best pose are left out ([`Bounds`], [`Extra::max_gain`]), and on the others the scores of those
/// sub-trees stay whose terms have not changed since the last time ([`Extra::key`]).
///
/// Keeps up to 64 MiB of score planes, those of the most promising levels, and gives them back to the
/// solver when it is dropped.
#[derive(Debug)]
pub struct Again<'a> {
    solver: &'a Solver,
    evidence: &'a Responses<'a>,
    own_bounds: Option<Bounds>,
    /// By level: the planes of the last solution.
    kept: Vec<Mutex<Option<Workspace>>>,
    /// By level: whether its planes are to be kept.
    keep: Vec<bool>,
    /// Levels to be looked at and the most that each can score, best first.
    order: Vec<(f64, u16)>,
}

impl Solver {
    /// Begins to solve `evidence` repeatedly.
    ///
    /// # Panics
    ///
    /// If the evidence is another model's.
    pub fn again<'a>(&'a self, evidence: &'a Responses<'a>) -> Again<'a> {
        self.check(evidence);
        let n_levels = evidence.layout().levels.len();
        Again {
            solver: self,
            evidence,
            own_bounds: None,
            kept: (0..n_levels).map(|_| Mutex::new(None)).collect(),
            keep: vec![false; n_levels],
            order: Vec::with_capacity(n_levels),
        }
    }
}

impl Again<'_> {
    /// The best pose over the offered levels; see [`Solver::best`].
    ///
    /// Without [`Responses::with_bounds`] the first call computes them.
    ///
    /// * `guess`: a pose that may be nearly as good as the best, such as the last answer. It only
    ///   saves work.
    pub fn best(&mut self, extra: &dyn Extra, guess: Option<&Pose>) -> Option<Pose> {
        let (solver, evidence) = (self.solver, self.evidence);
        if evidence.bounds().is_none() && self.own_bounds.is_none() {
            self.own_bounds = Some(solver.bounds(evidence));
        }
        self.choose_levels(extra, guess);
        let this = &*self;
        let search = Search {
            solver,
            evidence,
            extra: Some(extra),
            best: Mutex::new(None),
        };
        let put_back = |level: u16, it: Workspace| this.put_back(level, it);
        let run = |&(upper, level): &(f64, u16)| {
            if search.could_win(upper) {
                search.look_at(level, this.workspace(level), &put_back);
            }
        };
        if in_pool() {
            self.order.par_iter().with_max_len(1).for_each(run);
        } else {
            self.order.iter().for_each(run);
        }
        search.finish(&put_back)
    }

    /// Number of levels that the last solution could not rule out before it looked at any.
    pub fn n_levels(&self) -> usize {
        self.order.len()
    }

    /// Finds the levels that may hold the best pose, and those of them whose planes will be kept.
    fn choose_levels(&mut self, extra: &dyn Extra, guess: Option<&Pose>) {
        let (solver, evidence) = (self.solver, self.evidence);
        let lowest = guess
            .filter(|it| evidence.covers(it))
            .map_or(f32::NEG_INFINITY, |pose| {
                solver.score(evidence, pose, Some(extra))
            });
        let gain = solver.max_gain(extra);
        let n_parts = solver.model.n_parts();
        self.order.clear();
        if let Some(bounds) = evidence.bounds().or(self.own_bounds.as_ref()) {
            let uppers = evidence.levels().iter();
            let uppers = uppers.map(|&it| (bounds.upper(it, gain, lowest, n_parts), it));
            // A bound that is no number says nothing.
            let is_below = |upper: f64| upper < f64::from(lowest);
            self.order.extend(uppers.filter(|it| !is_below(it.0)));
        }
        self.order
            .sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.keep.fill(false);
        let mut room = ROOM;
        for &(_, level) in &self.order {
            let bytes = Problem::new(solver, evidence, None, level).bytes();
            if bytes <= room {
                room -= bytes;
                self.keep[usize::from(level)] = true;
            }
        }
        for (kept, keep) in self.kept.iter().zip(&self.keep) {
            if !keep && let Some(it) = lock(kept).take() {
                solver.put_back(it);
            }
        }
    }

    fn workspace(&self, level: u16) -> Workspace {
        let kept = lock(&self.kept[usize::from(level)]).take();
        kept.unwrap_or_else(|| {
            let problem = Problem::new(self.solver, self.evidence, None, level);
            self.solver.workspace(problem.bytes())
        })
    }

    fn put_back(&self, level: u16, workspace: Workspace) {
        if self.keep[usize::from(level)] {
            *lock(&self.kept[usize::from(level)]) = Some(workspace);
        } else {
            self.solver.put_back(workspace);
        }
    }
}

impl Drop for Again<'_> {
    fn drop(&mut self) {
        for kept in &self.kept {
            if let Some(it) = lock(kept).take() {
                self.solver.put_back(it);
            }
        }
    }
}
