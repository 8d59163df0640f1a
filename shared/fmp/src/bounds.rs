//! Upper bounds of the scores on every level, for exact pruning.

/// For every level of a layout, the score of its best pose without the terms of other views.
///
/// If the terms add at most a known gain, a level is skipped if its bound plus the gain is below the score of a known pose, because it
/// cannot contain the best pose.
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
    /// Bound of a level without information.
    pub const UNKNOWN: Self = Self {
        best: f32::INFINITY,
        size: 0.0,
    };
}

impl Bounds {
    /// Creates the bounds from the bounds of some levels; the other levels are unknown.
    ///
    /// * `n_levels`: total number of levels, with or without responses.
    pub(crate) fn of_some(n_levels: usize, found: Vec<(u16, Bound)>) -> Self {
        let mut bounds = vec![Bound::UNKNOWN; n_levels];
        for (level, bound) in found {
            bounds[usize::from(level)] = bound;
        }
        Self(bounds)
    }

    /// Creates the bounds from values computed elsewhere, one for each level of the layout, with or without responses.
    ///
    /// Bounds that are too low give wrong results, but do no other harm.
    pub fn new(of_levels: Vec<Bound>) -> Self {
        Self(of_levels)
    }

    /// Returns the bound of every level, with or without responses.
    pub fn levels(&self) -> &[Bound] {
        &self.0
    }

    /// Returns the total number of levels, with or without responses.
    pub fn n_levels(&self) -> usize {
        self.0.len()
    }

    /// Returns the upper bound of the score of a pose on a level, under terms that add at most `gain`, for poses that score at least
    /// `lowest`. The two values of `gain` are the sum over the parts and the sum of the absolute values. The bound is not finite if it is
    /// unknown.
    ///
    /// Rounding is monotone, so a computed score never exceeds the score computed with every term at
    /// its bound. That score differs from the sum computed here by rounding alone. A score takes
    /// eight sums per part. If the score is not below `lowest`, each partial sum lies between
    /// `lowest` minus the maximum that can be added to it, and the maximum total. Both orders of
    /// summation are off by at most half an ulp of that range per sum. The factor below is four times as
    /// large.
    pub(crate) fn upper(
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

/// Upper bound of a score; see [`Bounds::upper`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Upper {
    /// The upper bound.
    pub(crate) most: f64,
    /// Allowance for rounding errors.
    rounding: f64,
}

impl Upper {
    /// Returns true if no pose on the level scores as much as `lowest`; false for a bound that is NaN.
    pub(crate) fn is_below(&self, lowest: f32) -> bool {
        self.most < f64::from(lowest)
    }

    /// Returns by how much a pose may fall short of the bound and still score at least `lowest`.
    ///
    /// If one term of a pose has a given value, the bound of the pose is [`Self::most`], minus that term's bound, plus the value. The value
    /// itself can be as large as the shortfall, and adds as much rounding again.
    pub(crate) fn slack(&self, lowest: f32) -> f64 {
        self.most - f64::from(lowest) + self.rounding
    }
}
