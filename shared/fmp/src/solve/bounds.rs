//! Computes the bounds of the scores on every level.

use super::sweep::Sweep;
use super::{ExtraTerms, Solver};
use crate::{Bound, Bounds, Responses, Spring, Springs};

impl Bound {
    /// Creates the bound of a level on which the messages have been computed without terms.
    ///
    /// * `edges`: see [`Solver::most_of_edges`].
    pub(super) fn of(sweep: &Sweep<'_>, edges: f64) -> Self {
        Self::of_own(sweep.highest(), sweep.own() + edges)
    }

    /// Creates the bound of a level from the known sum of the largest own scores and of the edges.
    fn of_own(best: f32, size: f64) -> Self {
        Self {
            best,
            size: (size as f32).next_up(),
        }
    }
}

impl Solver {
    /// Computes the bounds of the levels that have responses, with one solution without extra terms.
    ///
    /// # Panics
    ///
    /// If the evidence belongs to another model.
    pub fn bounds(&self, evidence: &Responses<'_>) -> Bounds {
        let edges = self.most_of_edges();
        let found = self.sweep_levels(evidence, evidence.levels(), None, |sweep| {
            (sweep.level(), Bound::of(sweep, edges))
        });
        Bounds::of_some(evidence.layout().levels.len(), found)
    }

    /// Returns the bound of a level whose messages were computed elsewhere without terms; bit-identical to [`Self::bounds`].
    ///
    /// * `best`: score of the best root, with the root bias.
    /// * `largest`: largest own score of every part.
    pub fn bound_of(&self, best: f32, largest: &[f32]) -> Bound {
        let mut begun = vec![false; largest.len()];
        let mut own = 0.0;
        // The values are added in the order in which a sweep visits the parts.
        for part in (0..largest.len()).rev() {
            let edge = self.model.spec().parts[part].edge.as_ref();
            for part in [Some(part), edge.map(|edge| edge.parent)].into_iter().flatten() {
                if !std::mem::replace(&mut begun[part], true) {
                    own += f64::from(largest[part].max(0.0));
                }
            }
        }
        Bound::of_own(best, own + self.most_of_edges())
    }

    /// Returns the maximum that springs and biases can add to a score.
    pub(super) fn most_of_edges(&self) -> f64 {
        let parts = self.model.spec().parts.iter();
        let of_edge = parts.filter_map(|part| part.edge.as_ref()).map(|edge| {
            let most = |most: f64, spring: &Spring| {
                let [xx, x, yy, y] = spring.w;
                most.max(x * x / (4.0 * xx) + y * y / (4.0 * yy))
            };
            let spring = match &edge.springs {
                Springs::PerChildType(all) => all.iter().fold(0.0, most),
                Springs::PerTypePair(all) => all.iter().flatten().flatten().fold(0.0, most),
            };
            let bias = edge.bias.iter().flatten().copied().fold(0.0, f64::max);
            bias + spring
        });
        of_edge.sum::<f64>() + self.model.spec().root_bias.abs()
    }

    /// Returns the upper bound of the terms' contribution to a pose, and the sum of the absolute values of the bounds.
    pub(super) fn max_gain(&self, extra: &dyn ExtraTerms) -> (f64, f64) {
        let gains = (0..self.model.n_parts()).map(|part| f64::from(extra.max_gain(part)));
        gains.fold((0.0, 0.0), |sums, it| (sums.0 + it, sums.1 + it.abs()))
    }
}
