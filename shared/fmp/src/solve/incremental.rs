//! Solves the same evidence repeatedly, under terms that change little from time to time.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::sweep::{Problem, Workspace};
use super::{ExtraTerms, Search, Solver};
use crate::bounds::Upper;
use crate::pool::{in_pool, lock};
use crate::{Bounds, Pose, Responses};

/// Maximum size of the score planes that are kept between solutions, in bytes.
const MAX_KEPT_BYTES: usize = 64 << 20;

/// Incremental solver: solves one view's evidence repeatedly, as the other views' terms change.
///
/// The results are bit-identical to those of [`Solver::best`], with less work. Levels that cannot contain the best pose are skipped
/// ([`Bounds`], [`ExtraTerms::max_gain`]). On the other levels, a term is not reduced below the value that already rules a pose out, which
/// keeps the windows of the transforms small. Finally, the scores of subtrees are reused if their terms have not changed since the last
/// solution ([`ExtraTerms::key`]).
///
/// The solver keeps up to 64 MiB of score planes, those of the most promising levels. When it is dropped, it returns the planes to the
/// [`Solver`].
#[derive(Debug)]
pub struct IncrementalSolver<'a> {
    solver: &'a Solver,
    evidence: &'a Responses<'a>,
    own_bounds: Option<Bounds>,
    /// The planes of the last solution for every level.
    kept: Vec<Mutex<Option<Workspace>>>,
    /// For every level, true if its planes must be kept.
    keep: Vec<bool>,
    /// The levels to solve with their upper bounds, best first.
    order: Vec<(Upper, u16)>,
    /// Score of the best initial guess.
    lowest: f32,
}

impl Solver {
    /// Prepares to solve `evidence` repeatedly.
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model.
    pub fn incremental<'a>(&'a self, evidence: &'a Responses<'a>) -> IncrementalSolver<'a> {
        self.check(evidence);
        let n_levels = evidence.layout().levels.len();
        IncrementalSolver {
            solver: self,
            evidence,
            own_bounds: None,
            kept: (0..n_levels).map(|_| Mutex::new(None)).collect(),
            keep: vec![false; n_levels],
            order: Vec::with_capacity(n_levels),
            lowest: f32::NEG_INFINITY,
        }
    }
}

impl IncrementalSolver<'_> {
    /// Returns the best pose over the levels that have responses; see [`Solver::best`].
    ///
    /// If the responses have no bounds ([`Responses::with_bounds`]), the first call computes them.
    ///
    /// * `guesses`: poses that may be nearly as good as the best, such as the last result. They only save work: the level of the best guess
    ///   is solved first, and levels that cannot reach its score are skipped.
    #[expect(
        single_use_lifetimes,
        reason = "anonymous lifetimes in `impl Trait` are unstable"
    )]
    pub fn best<'b>(
        &mut self,
        extra: &dyn ExtraTerms,
        guesses: impl IntoIterator<Item = &'b Pose>,
    ) -> Option<Pose> {
        let (solver, evidence) = (self.solver, self.evidence);
        if evidence.bounds().is_none() && self.own_bounds.is_none() {
            self.own_bounds = Some(solver.bounds(evidence));
        }
        self.choose_levels(extra, guesses);
        let this = &*self;
        let search = Search {
            solver,
            evidence,
            extra: Some(extra),
            tally: Some(&solver.tally),
            best: Mutex::new(None),
        };
        let entries = |&level: &u16| Problem::new(solver, evidence, None, level).n_entries();
        let n_entries = evidence.levels().iter().map(entries).sum();
        solver.tally.offered(evidence.levels().len(), n_entries);
        let put_back = |level: u16, it: Workspace| this.put_back(level, it);
        let run = |&(upper, level): &(Upper, u16)| {
            let lowest = search.score().max(this.lowest);
            if !upper.is_below(lowest) {
                let slack = upper.slack(lowest);
                search.solve_level(level, slack, this.workspace(level), &put_back);
            }
        };
        if in_pool() {
            // Idle threads take the levels in order: the earlier a good pose is found, the more levels are
            // skipped.
            let next = AtomicUsize::new(0);
            let threads = 0..rayon::current_num_threads().min(self.order.len());
            threads.into_par_iter().with_max_len(1).for_each(|_| {
                while let Some(it) = self.order.get(next.fetch_add(1, Ordering::Relaxed)) {
                    run(it);
                }
            });
        } else {
            self.order.iter().for_each(run);
        }
        search.finish(&put_back)
    }

    /// Returns the number of levels that the bounds could not rule out at the start of the last solution.
    pub fn n_levels(&self) -> usize {
        self.order.len()
    }

    /// Selects the levels that may contain the best pose, and those whose planes will be kept.
    #[expect(
        single_use_lifetimes,
        reason = "anonymous lifetimes in `impl Trait` are unstable"
    )]
    fn choose_levels<'b>(
        &mut self,
        extra: &dyn ExtraTerms,
        guesses: impl IntoIterator<Item = &'b Pose>,
    ) {
        let (solver, evidence) = (self.solver, self.evidence);
        let guesses = guesses.into_iter().filter(|guess| evidence.covers(guess));
        let (lowest, first) = guesses.fold((f32::NEG_INFINITY, None), |best, pose| {
            let score = solver.score(evidence, pose, Some(extra));
            if score > best.0 {
                (score, Some(pose.level))
            } else {
                best
            }
        });
        let gain = solver.max_gain(extra);
        let n_parts = solver.model.n_parts();
        self.order.clear();
        if let Some(bounds) = evidence.bounds().or(self.own_bounds.as_ref()) {
            let uppers = evidence.levels().iter();
            let uppers = uppers.map(|&upper| (bounds.upper(upper, gain, lowest, n_parts), upper));
            self.order.extend(uppers.filter(|upper| !upper.0.is_below(lowest)));
        }
        self.lowest = lowest;
        self.order.sort_unstable_by(|a, b| {
            let later = |level: u16| Some(level) != first;
            let by_bound = b.0.most.total_cmp(&a.0.most).then(a.1.cmp(&b.1));
            later(a.1).cmp(&later(b.1)).then(by_bound)
        });
        self.keep.fill(false);
        let mut room = MAX_KEPT_BYTES;
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

impl Drop for IncrementalSolver<'_> {
    fn drop(&mut self) {
        for kept in &self.kept {
            if let Some(it) = lock(kept).take() {
                self.solver.put_back(it);
            }
        }
    }
}
