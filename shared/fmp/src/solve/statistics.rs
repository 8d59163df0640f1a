//! Counters that show how much of the full work the incremental solver does.

use std::sync::atomic::{AtomicU64, Ordering};

/// Sums over all solutions of all [`IncrementalSolver`](crate::IncrementalSolver)s of a solver.
///
/// An entry is one value of a max-sum message: the value of one part for one cell of its parent. With several threads, the counters depend
/// on timing; the results do not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SolveStatistics {
    /// Number of solutions.
    pub solutions: u64,
    /// Number of levels with responses.
    pub levels_offered: u64,
    /// Number of levels that bounds could not rule out.
    pub levels_solved: u64,
    /// Number of message entries on all levels with responses.
    pub entries_offered: u64,
    /// Number of message entries on the levels that bounds could not rule out.
    pub entries_solved: u64,
    /// Number of message entries that were computed because they could not be reused from the previous solution.
    pub entries_computed: u64,
}

impl SolveStatistics {
    /// Returns the difference from earlier counters.
    #[must_use]
    pub fn since(&self, before: &Self) -> Self {
        Self {
            solutions: self.solutions - before.solutions,
            levels_offered: self.levels_offered - before.levels_offered,
            levels_solved: self.levels_solved - before.levels_solved,
            entries_offered: self.entries_offered - before.entries_offered,
            entries_solved: self.entries_solved - before.entries_solved,
            entries_computed: self.entries_computed - before.entries_computed,
        }
    }
}

/// Like [`SolveStatistics`], with atomic counters.
#[derive(Debug, Default)]
pub(super) struct Tally {
    solutions: AtomicU64,
    levels_offered: AtomicU64,
    levels_solved: AtomicU64,
    entries_offered: AtomicU64,
    entries_solved: AtomicU64,
    entries_computed: AtomicU64,
}

impl Tally {
    /// Counts a solution that is about to begin.
    pub(super) fn offered(&self, levels: usize, entries: usize) {
        add(&self.solutions, 1);
        add(&self.levels_offered, levels);
        add(&self.entries_offered, entries);
    }

    /// Counts a level that was solved.
    pub(super) fn solved(&self, entries: usize, computed: usize) {
        add(&self.levels_solved, 1);
        add(&self.entries_solved, entries);
        add(&self.entries_computed, computed);
    }

    pub(super) fn sums(&self) -> SolveStatistics {
        let of = |sum: &AtomicU64| sum.load(Ordering::Relaxed);
        SolveStatistics {
            solutions: of(&self.solutions),
            levels_offered: of(&self.levels_offered),
            levels_solved: of(&self.levels_solved),
            entries_offered: of(&self.entries_offered),
            entries_solved: of(&self.entries_solved),
            entries_computed: of(&self.entries_computed),
        }
    }
}

fn add(sum: &AtomicU64, n: usize) {
    sum.fetch_add(n as u64, Ordering::Relaxed);
}
