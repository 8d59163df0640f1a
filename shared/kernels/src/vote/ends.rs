//! The least and the largest score of a plane, kept while it is written.

use super::ROW_ALIGN;
use crate::simd::Simd;

/// The least and the largest score of a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The least one.
    pub least: f32,
    /// The largest one.
    pub most: f32,
}

impl Span {
    /// Of no scores.
    pub const NONE: Self = Self {
        least: f32::INFINITY,
        most: f32::NEG_INFINITY,
    };

    /// Largest difference between two scores, and a little more.
    ///
    /// The excess, 1e-5 of the scores themselves, is larger than what rounding to single precision
    /// can add to or take from a difference. Infinite if some are minus infinity, NaN if all are:
    /// both ask for the whole plane to be searched.
    #[inline(always)]
    pub(crate) fn spread(self) -> f32 {
        (self.most - self.least) + 1e-5 * (self.most.abs() + self.least.abs())
    }
}

/// Least and largest score seen, lane by lane.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ends {
    least: [f32; ROW_ALIGN],
    most: [f32; ROW_ALIGN],
}

impl Ends {
    /// Nothing has been seen.
    pub(super) const NONE: Self = Self {
        least: [f32::INFINITY; ROW_ALIGN],
        most: [f32::NEG_INFINITY; ROW_ALIGN],
    };

    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S) -> [S::V; 2] {
        [simd.load(&self.least), simd.load(&self.most)]
    }

    #[inline(always)]
    pub(super) fn store<S: Simd>(&mut self, simd: S, [least, most]: [S::V; 2]) {
        simd.store(least, &mut self.least);
        simd.store(most, &mut self.most);
    }

    /// Adds the scores of the first `n` lanes, the others holding minus infinity.
    #[inline(always)]
    pub(super) fn see<S: Simd>(
        simd: S,
        [least, most]: [S::V; 2],
        scores: S::V,
        n: usize,
    ) -> [S::V; 2] {
        let counted = if n < S::LANES {
            simd.first(n, scores, simd.splat(f32::INFINITY))
        } else {
            scores
        };
        [simd.min(counted, least), simd.max(scores, most)]
    }

    #[inline(always)]
    pub(super) fn span(&self) -> Span {
        let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
        for lane in 0..ROW_ALIGN {
            least = least.min(self.least[lane]);
            most = most.max(self.most[lane]);
        }
        Span { least, most }
    }
}
