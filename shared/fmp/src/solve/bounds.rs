//! What every level can offer at most: the start of exact pruning.

use super::sweep::Sweep;
use super::{ExtraTerms, Solver};
use crate::{Responses, Spring, Springs};

/// For every level of a layout the score of its best pose without the terms of other views.
///
/// With terms that add at most a known gain, a level whose bound stays below the score of some pose
/// cannot hold the best one, and need not be looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds(Vec<Bound>);

/// What one level can offer at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// Score of the best pose, without the terms of other views; infinite where it is not known.
    pub best: f32,
    /// More than any sum on the way to a score can be, terms of other views not counted.
    pub size: f32,
}

impl Bound {
    /// Of a level of which nothing is known.
    pub const UNKNOWN: Self = Self {
        best: f32::INFINITY,
        size: 0.0,
    };
}

impl Bound {
    /// Of a level on which the votes have been cast without terms.
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
    /// The bounds of some levels; nothing is known of the others.
    pub(super) fn of_some(evidence: &Responses<'_>, found: Vec<(u16, Bound)>) -> Self {
        let mut bounds = vec![Bound::UNKNOWN; evidence.layout().levels.len()];
        for (level, bound) in found {
            bounds[usize::from(level)] = bound;
        }
        Self(bounds)
    }

    /// Bounds that were found elsewhere, one per level of the layout, offered or not.
    ///
    /// Bounds that are too low make wrong answers, and do no other harm.
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

    /// The most that a pose on a level can score under terms that add at most `gain` (the sum over
    /// the parts, and that of its absolute values), unless it scores less than `lowest`. Not finite:
    /// nothing is known.
    ///
    /// Rounding is monotone, so a computed score never exceeds the one computed with every term at
    /// its bound. That one and the sum made here differ by rounding alone: the way to a score has
    /// eight sums per part, each of which, if the score is not below `lowest`, lies between `lowest`
    /// less all that can be added to it and all that can be added; both ways of summing are off by
    /// at most half an ulp of that per sum. The factor below is four times as large.
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
    /// Whether nothing on the level scores as much as `lowest`; a bound that is no number says nothing.
    pub(super) fn is_below(&self, lowest: f32) -> bool {
        self.most < f64::from(lowest)
    }

    /// What a pose can lose against the bound without scoring less than `lowest`.
    ///
    /// The bound of a pose one of whose terms has a given value is [`Self::most`], less that term's
    /// bound, plus the value; the value itself may be as large as what is lost, and adds as much
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

    /// All that springs and biases can add to a score.
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
