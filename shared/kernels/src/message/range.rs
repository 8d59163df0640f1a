//! The minimum and maximum score of a plane, updated while the plane is written.

use super::ROW_ALIGN;
use crate::simd::Simd;

/// The minimum and maximum score of a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoreRange {
    /// The minimum score.
    pub min: f32,
    /// The maximum score.
    pub max: f32,
}

impl ScoreRange {
    /// The empty range.
    pub const NONE: Self = Self {
        min: f32::INFINITY,
        max: f32::NEG_INFINITY,
    };

    /// The maximum difference between two scores, with a small excess.
    ///
    /// The excess is 1e-5 of the size of the scores, which is more than rounding to single precision can change a difference. The result is
    /// infinite if some scores are minus infinity, and NaN if all are. In both cases, the whole plane is searched.
    #[inline(always)]
    pub(crate) fn spread(self) -> f32 {
        (self.max - self.min) + 1e-5 * (self.max.abs() + self.min.abs())
    }
}

/// Minimum and maximum score so far, lane by lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct RunningRange {
    min: [f32; ROW_ALIGN],
    max: [f32; ROW_ALIGN],
}

impl RunningRange {
    /// The empty range.
    pub(super) const NONE: Self = Self {
        min: [f32::INFINITY; ROW_ALIGN],
        max: [f32::NEG_INFINITY; ROW_ALIGN],
    };

    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S) -> [S::V; 2] {
        [simd.load(&self.min), simd.load(&self.max)]
    }

    #[inline(always)]
    pub(super) fn store<S: Simd>(&mut self, simd: S, [min, max]: [S::V; 2]) {
        simd.store(min, &mut self.min);
        simd.store(max, &mut self.max);
    }

    /// Includes the scores of the first `n` lanes; the other lanes contain minus infinity.
    #[inline(always)]
    pub(super) fn include<S: Simd>(
        simd: S,
        [min, max]: [S::V; 2],
        scores: S::V,
        n: usize,
    ) -> [S::V; 2] {
        let counted = if n < S::LANES {
            simd.first(n, scores, simd.splat(f32::INFINITY))
        } else {
            scores
        };
        [simd.min(counted, min), simd.max(scores, max)]
    }

    #[inline(always)]
    pub(super) fn range(&self) -> ScoreRange {
        let (mut min, mut max) = (f32::INFINITY, f32::NEG_INFINITY);
        for lane in 0..ROW_ALIGN {
            min = min.min(self.min[lane]);
            max = max.max(self.max[lane]);
        }
        ScoreRange { min, max }
    }
}
