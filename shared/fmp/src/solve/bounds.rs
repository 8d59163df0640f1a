//! Upper bounds of the scores on every level, for exact pruning.

use super::sweep::Sweep;
use super::{ExtraTerms, Solver};
use crate::{Responses, Spring, Springs};

/// For every level of a layout the score of its best pose without the terms of other views.
///
/// With terms that add at most a known gain, a level whose bound is below the score of some pose
/// cannot hold the best one and is skipped.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds(Vec<Bound>);

/// The bounds of one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Score of the best pose without the terms of other views; infinite if unknown.
    pub best: f32,
    /// Upper bound of all partial sums of a score, without the terms of other views.
    pub size: f32,
}

impl Bound {
    /// For a level without information.
    pub const UNKNOWN: Self = Self {
        best: f32::INFINITY,
        size: 0.0,
    };
}

impl Bound {
    /// For a level on which the messages have been computed without terms.
    ///
    /// * `edges`: see [`Solver::most_of_edges`].
    pub(super) fn of(sweep: &Sweep<'_>, edges: f64) -> Self {
        Self {
            best: sweep.highest(),
            size: ((sweep.own() + edges) as f32).next_up(),
        }
    }
}

impl Bounds {
    /// The bounds of some levels; the others are unknown.
    pub(super) fn of_some(evidence: &Responses<'_>, found: Vec<(u16, Bound)>) -> Self {
        let mut bounds = vec![Bound::UNKNOWN; evidence.layout().levels.len()];
        for (level, bound) in found {
            bounds[usize::from(level)] = bound;
        }
        Self(bounds)
    }

    /// Bounds that were computed elsewhere, one per level of the layout, offered or not.
    ///
    /// Bounds that are too low give wrong results, but are otherwise harmless.
    pub fn new(of_levels: Vec<Bound>) -> Self {
        Self(of_levels)
    }

    /// The bound of every level, offered or not.
    pub fn levels(&self) -> &[Bound] {
        &self.0
    }

    /// Number of levels, offered or not.
    pub fn n_levels(&self) -> usize {
        self.0.len()
    }

    /// Upper bound of the score of a pose on a level under terms that add at most `gain` (the sum
    /// over the parts, and that of its absolute values), for poses that score at least `lowest`.
    /// Not finite if unknown.
    ///
    /// Rounding is monotone, so a computed score never exceeds the one computed with every term at
    /// its bound. That one differs from the sum computed here by rounding alone. A score takes
    /// eight sums per part. If the score is not below `lowest`, each partial sum lies between
    /// `lowest` minus all that can be added to it and all that can be added; both orders of
    /// summation are off by at most half an ulp of that per sum. The factor below is four times as
    /// large.
    pub(super) fn upper(
        &self,
        level: u16,
        (gain, sizes): (f64, f64),
        lowest: f32,
        n_parts: usize,
    ) -> Upper {
        let it = self.0[usize::from(level)];
        let size = f64::from(it.size) + sizes + f64::from(lowest.max(-f32::MAX)).abs();
        let rounding = 8.0 * n_parts as f64 * f64::from(f32::EPSILON) * 4.0 * size;
        Upper {
            most: f64::from(it.best) + gain + rounding,
            rounding,
        }
    }
}

/// See [`Bounds::upper`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Upper {
    /// The bound.
    pub(super) most: f64,
    /// What it allows for rounding.
    rounding: f64,
}

impl Upper {
    /// Whether no pose on the level scores as much as `lowest`; false for a bound that is NaN.
    pub(super) fn is_below(&self, lowest: f32) -> bool {
        self.most < f64::from(lowest)
    }

    /// The most that a pose can lose against the bound without scoring less than `lowest`.
    ///
    /// The bound of a pose one of whose terms has a given value is [`Self::most`], minus that
    /// term's bound, plus the value. The value itself can be as large as the loss, and adds as much
    /// rounding again.
    pub(super) fn slack(&self, lowest: f32) -> f64 {
        self.most - f64::from(lowest) + self.rounding
    }
}

impl Solver {
    /// The bounds of the offered levels: one solution without extra terms.
    ///
    /// # Panics
    ///
    /// If the evidence is another model's.
    pub fn bounds(&self, evidence: &Responses<'_>) -> Bounds {
        let edges = self.most_of_edges();
        let found = self.sweep_levels(evidence, evidence.levels(), None, |sweep| {
            (sweep.level(), Bound::of(sweep, edges))
        });
        Bounds::of_some(evidence, found)
    }

    /// The maximum that springs and biases can add to a score.
    pub(super) fn most_of_edges(&self) -> f64 {
        let parts = self.model.spec().parts.iter();
        let of_edge = parts.filter_map(|it| it.edge.as_ref()).map(|edge| {
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

    /// Upper bound of what the terms can add to a pose, and the sum of the bounds' absolute values.
    pub(super) fn max_gain(&self, extra: &dyn ExtraTerms) -> (f64, f64) {
        let gains = (0..self.model.n_parts()).map(|part| f64::from(extra.max_gain(part)));
        gains.fold((0.0, 0.0), |sums, it| (sums.0 + it, sums.1 + it.abs()))
    }
}
