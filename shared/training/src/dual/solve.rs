//! The steps of the dual coordinate descent.

use rayon::prelude::*;

use super::{Entry, Machine};

/// The duality gap of the solution on the working set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Value of the primal objective: an upper bound of the optimum.
    pub primal: f64,
    /// Value of the dual objective: a lower bound of the optimum.
    pub dual: f64,
    /// Number of support vectors: examples with a share in the solution.
    pub n_support: usize,
}

impl Gap {
    /// The gap as a share of the primal objective.
    pub fn relative(&self) -> f64 {
        if self.primal > 0.0 {
            (self.primal - self.dual) / self.primal
        } else {
            0.0
        }
    }
}

/// The stopping criteria of the dual coordinate descent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Duality gap at which to stop, as a share of the objective.
    pub tolerance: f64,
    /// Maximum number of passes over all examples.
    pub max_passes: usize,
}

/// Maximum number of passes over the active examples between two passes over all examples.
const PASSES_OVER_MOVING: usize = 10;

/// An example with a share between 0 and its cost counts as optimal if it misses or exceeds its margin by less than this.
const RESTING: f64 = 0.01;

/// Slack below which an example without a share stays active until the next pass over all examples.
const NEAR: f64 = 0.05;

impl<K: Ord + Clone + Sync, T: Sync> Machine<K, T> {
    /// Improves the solution until the gap is small enough or the number of passes is reached.
    ///
    /// * `go_on`: called with the gap before the first and after every pass; returns true to continue.
    pub fn solve(
        &mut self,
        effort: Effort,
        random: &mut fastrand::Rng,
        go_on: &mut dyn FnMut(Gap) -> bool,
    ) -> Gap {
        self.sum_up();
        let mut slopes = self.slopes();
        let mut gap = self.gap_of(&slopes);
        for _ in 0..effort.max_passes {
            if !go_on(gap) || gap.relative() <= effort.tolerance {
                return gap;
            }
            let at_stake = |i: &usize| self.entries[*i].share > 0.0 || slopes[*i] > -NEAR;
            let mut moving: Vec<_> = (0..self.entries.len()).filter(at_stake).collect();
            for _ in 0..PASSES_OVER_MOVING {
                // Memory access would be faster if the examples of one image stayed together. But the descent would need several times as
                // many passes: the root's bias converges only if right and wrong examples alternate.
                random.shuffle(&mut moving);
                moving.retain(|&i| self.step(i));
            }
            slopes = self.slopes();
            gap = self.gap_of(&slopes);
        }
        go_on(gap);
        gap
    }

    /// The duality gap on the working set.
    pub fn gap(&self) -> Gap {
        self.gap_of(&self.slopes())
    }

    fn slopes(&self) -> Vec<f64> {
        let all = (0..self.entries.len()).into_par_iter();
        all.map(|i| self.slope(i)).collect()
    }

    fn gap_of(&self, slopes: &[f64]) -> Gap {
        let mut worst = vec![0.0_f64; self.groups.len()];
        let mut dual = 0.0;
        let mut n_support = 0;
        for (it, entry) in self.entries.iter().enumerate() {
            worst[entry.group] = worst[entry.group].max(slopes[it]);
            dual += entry.share * entry.margin;
            n_support += usize::from(entry.share > 0.0);
        }
        let half: f64 = self.solution().iter().map(|solution| 0.5 * solution * solution).sum();
        let losses = worst.iter().zip(&self.groups).map(|(slope, of)| of.cost * slope);
        Gap {
            primal: half + losses.sum::<f64>(),
            dual: dual - half,
            n_support,
        }
    }

    /// Amount by which an example misses its margin. This is the derivative of the dual objective with respect to the share of the example.
    pub(super) fn slope(&self, at: usize) -> f64 {
        let Entry { margin, x, .. } = &self.entries[at];
        margin - x.dot(&self.solution)
    }

    /// Recomputes the solution from the shares, so that it depends only on them.
    fn sum_up(&mut self) {
        self.sum.fill(0.0);
        for entry in &self.entries {
            if entry.share > 0.0 {
                entry.x.add_to(&mut self.sum, entry.share);
            }
        }
        for (solution, sum) in self.solution.iter_mut().zip(&self.sum) {
            *solution = *sum as f32;
        }
        for it in &mut self.solution[self.non_negative.clone()] {
            *it = it.max(0.0);
        }
    }

    /// Sets the share of one example to its best value while all other shares are fixed. If the shares of its group
    /// are used up, the share is taken from another example of the group. Returns `true` if the share changed enough for the example
    /// to stay active.
    fn step(&mut self, at: usize) -> bool {
        let slope = self.slope(at);
        let entry = &self.entries[at];
        let group = &self.groups[entry.group];
        let room = group.cost - group.total;
        if slope > 0.0 && room <= group.cost * FULL {
            return self.exchange(at, slope);
        }
        let wanted = newton(slope, entry.squared_norm);
        self.change(at, wanted.clamp(-entry.share, room.max(0.0))) && slope.abs() > RESTING
    }

    /// Moves some of the share of the group member that needs it least to this example, if this improves the solution.
    fn exchange(&mut self, at: usize, slope: f64) -> bool {
        let members = &self.groups[self.entries[at].group].members;
        let givers = members
            .iter()
            .filter(|&&it| it != at && self.entries[it].share > 0.0)
            .map(|&member| (self.slope(member), member));
        let Some((least, giver)) = givers.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return false;
        };
        let (to, from) = (&self.entries[at], &self.entries[giver]);
        let curvature = to.squared_norm + from.squared_norm - 2.0 * to.x.dot_sparse(&from.x);
        if least >= slope {
            return false;
        }
        let share = newton(slope - least, curvature).min(from.share);
        let moved = self.change(giver, -share) | self.change(at, share);
        moved && slope - least > RESTING
    }

    fn change(&mut self, at: usize, by: f64) -> bool {
        if by == 0.0 {
            return false;
        }
        let entry = &mut self.entries[at];
        entry.share = (entry.share + by).max(0.0);
        self.groups[entry.group].total += by;
        entry.x.add_to(&mut self.sum, by);
        for (start, len) in entry.x.spans() {
            let may_be_negative = !self.non_negative.contains(&start);
            let solution = self.solution[start..start + len].iter_mut();
            for (solution, sum) in solution.zip(&self.sum[start..]) {
                *solution = if may_be_negative { *sum } else { sum.max(0.0) } as f32;
            }
        }
        true
    }
}

/// The Newton step along a slope. It is unlimited if the curvature is 0 (an example of zeros, or a duplicate).
fn newton(slope: f64, curvature: f64) -> f64 {
    if curvature > 0.0 {
        slope / curvature
    } else if slope == 0.0 {
        0.0
    } else {
        f64::INFINITY.copysign(slope)
    }
}

/// Unused share of a group, relative to its cost, below which the group counts as full despite rounding.
const FULL: f64 = 1e-9;
