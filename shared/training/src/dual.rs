//! The structural support vector machine, solved by dual coordinate descent over the working set of examples.
//!
//! Primal: `min_v 1/2 |v|^2 + sum_g C_g max(0, max_{j in g} (b_j - v . x_j))`, where some coordinates of `v` must not be negative. Each
//! example `j` belongs to a group `g`: one person, or one position in a negative image. Only the worst example of a group counts. The
//! factor `a_j` is called the share of example `j` in the solution. Dual: `max_a sum_j a_j b_j - 1/2 |v(a)|^2` with `a_j >= 0`, `sum_{j in
//! g} a_j <= C_g`, and `v(a) = [sum_j a_j x_j]` where negative values of those coordinates are set to 0. Source: Yang & Ramanan 2013,
//! section 5, and the known properties of the solver in the authors' release.

mod solve;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::ops::Range;

use crate::sparse::Sparse;

pub use solve::{Effort, Gap};

/// A constraint on the solution: `v . x >= margin`.
#[derive(Debug, Clone, PartialEq)]
pub struct Constraint {
    /// The example.
    pub x: Sparse,
    /// Smallest permitted product of the example and the solution.
    pub margin: f64,
}

#[derive(Debug)]
struct Entry<T> {
    x: Sparse,
    squared_norm: f64,
    margin: f64,
    group: usize,
    share: f64,
    tag: T,
}

#[derive(Debug)]
struct Group<K> {
    key: K,
    cost: f64,
    /// Sum of the shares of the group's members; at most the cost.
    total: f64,
    members: Vec<usize>,
}

/// The group of an example, and the cost of violating its margin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost<K> {
    /// Group of the example; only the worst example of a group counts.
    pub group: K,
    /// Cost per unit by which the worst example of the group misses its margin.
    pub of_unit: f64,
}

/// The working set of examples, and the solution so far.
///
/// `K` identifies the groups, and `T` is the caller's tag of an example.
#[derive(Debug)]
pub struct Machine<K, T> {
    entries: Vec<Entry<T>>,
    groups: Vec<Group<K>>,
    group_of: BTreeMap<K, usize>,
    non_negative: Range<usize>,
    /// Sum of the examples, weighted by their shares.
    sum: Vec<f64>,
    /// The solution: the sum, with negative values of the non-negative coordinates set to 0.
    solution: Vec<f32>,
    bytes: usize,
}

impl<K: Ord + Clone + Sync, T: Sync> Machine<K, T> {
    /// Makes a machine without examples, whose solution is 0.
    ///
    /// * `non_negative`: coordinates that must not become negative.
    pub fn new(n_coordinates: usize, non_negative: Range<usize>) -> Self {
        Self {
            entries: Vec::new(),
            groups: Vec::new(),
            group_of: BTreeMap::new(),
            non_negative,
            sum: vec![0.0; n_coordinates],
            solution: vec![0.0; n_coordinates],
            bytes: 0,
        }
    }

    /// Adds a constraint. The cost of a group is the cost of its first example.
    ///
    /// * `share`: weight of the example in the solution; 0 for a new example, see [`Self::entries`].
    pub fn add(&mut self, cost: Cost<K>, tag: T, demand: Constraint, share: f64) {
        let Cost { group, of_unit } = cost;
        let groups = &mut self.groups;
        let group = *self.group_of.entry(group.clone()).or_insert_with(|| {
            groups.push(Group {
                key: group,
                cost: of_unit,
                total: 0.0,
                members: Vec::new(),
            });
            groups.len() - 1
        });
        groups[group].members.push(self.entries.len());
        groups[group].total += share;
        let Constraint { x, margin } = demand;
        self.bytes += x.bytes();
        self.entries.push(Entry {
            squared_norm: x.squared_norm(),
            x,
            margin,
            group,
            share,
            tag,
        });
    }

    /// Number of examples.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Returns true if there is no example.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Memory used by the examples, in bytes.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Tags and shares of all examples, in the order in which they were added. Adding them again in this
    /// order with these shares gives the same machine.
    pub fn entries(&self) -> impl Iterator<Item = (&T, f64)> {
        self.entries.iter().map(|entry| (&entry.tag, entry.share))
    }

    /// The solution.
    pub fn solution(&self) -> Vec<f64> {
        let mut solution = self.sum.clone();
        for it in &mut solution[self.non_negative.clone()] {
            *it = it.max(0.0);
        }
        solution
    }

    /// Keeps only the wanted examples. The others are removed, and their shares in the solution are dropped.
    pub fn retain(&mut self, wanted: impl Fn(&T) -> bool) {
        self.keep(&|entry| wanted(&entry.tag));
    }

    /// Shrinks the working set. First removes the examples that have no share in the solution and exceed their margin by more than `room`.
    /// Then removes other examples without a share, the ones with the largest slack first, until at most `bytes` are used.
    ///
    /// * `may_go`: returns true if an example with this tag may be removed.
    pub fn forget(&mut self, room: f64, bytes: usize, may_go: impl Fn(&T) -> bool) {
        let mut idle: Vec<(f64, usize)> = (0..self.entries.len())
            .filter(|&i| self.entries[i].share == 0.0 && may_go(&self.entries[i].tag))
            .map(|i| (self.slope(i), i))
            .collect();
        idle.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut left = self.bytes;
        for (slope, it) in idle {
            if left <= bytes && slope >= -room {
                break;
            }
            left -= self.entries[it].x.bytes();
            self.entries[it].share = f64::NAN;
        }
        self.keep(&|entry| !entry.share.is_nan());
    }

    /// Removes entries, and groups without entries. The remaining groups are ordered by their first entry,
    /// so that the machine is the same as if the removed entries had never been added.
    fn keep(&mut self, wanted: &dyn Fn(&Entry<T>) -> bool) {
        let groups = std::mem::take(&mut self.groups);
        let entries = std::mem::take(&mut self.entries);
        self.group_of.clear();
        self.bytes = 0;
        for it in entries {
            if wanted(&it) {
                let cost = Cost {
                    group: groups[it.group].key.clone(),
                    of_unit: groups[it.group].cost,
                };
                let demand = Constraint {
                    x: it.x,
                    margin: it.margin,
                };
                self.add(cost, it.tag, demand, it.share);
            }
        }
    }
}
