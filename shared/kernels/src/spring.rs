//! The spring between a child and its parent, and how far it can be stretched to advantage.

use std::ops::Range;

/// A quadratic spring.
///
/// With the parent at cell `p` and the child at `v`, `d = p + anchor - v` and the spring adds
/// `-(w[0] d_x^2 + w[1] d_x + w[2] d_y^2 + w[3] d_y)` to the score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// `[d_x^2, d_x, d_y^2, d_y]`; the quadratic ones are positive.
    pub w: [f64; 4],
    /// Offset `[x, y]` of the child at which `d` is zero, cells.
    pub anchor: [i32; 2],
}

/// One axis of a [`Spring`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axis {
    pub(crate) quadratic: f64,
    pub(crate) linear: f64,
    pub(crate) anchor: i32,
}

/// Cells by which a window is wider than exact arithmetic asks for, so that rounding cannot make a
/// candidate outside of it tie with the best one inside.
const SLACK: f64 = 1.0;

impl Spring {
    pub(crate) fn x(&self) -> Axis {
        Axis {
            quadratic: self.w[0],
            linear: self.w[1],
            anchor: self.anchor[0],
        }
    }

    pub(crate) fn y(&self) -> Axis {
        Axis {
            quadratic: self.w[2],
            linear: self.w[3],
            anchor: self.anchor[1],
        }
    }
}

impl Axis {
    /// What the spring adds to the score when the child lies `offset` cells after its parent.
    ///
    /// Computed in double and rounded once, so that every caller adds the same number.
    #[inline(always)]
    pub(crate) fn score(self, offset: isize) -> f32 {
        let d = f64::from(self.anchor) - offset as f64;
        -(self.quadratic * d * d + self.linear * d) as f32
    }

    /// The children that can be best for a parent at `p`, out of `n`.
    ///
    /// * `spread`: largest difference between the scores of any two children. With the best place
    ///   `c` of the spring and `v0` the nearest child to it, a child at `v` loses to `v0` if
    ///   `quadratic ((v - c)^2 - (v0 - c)^2) > spread`; so all winners lie within
    ///   `sqrt(spread / quadratic + (v0 - c)^2)` of `c`. Not finite: all children.
    #[inline(always)]
    pub(crate) fn window(self, p: usize, n: usize, spread: f32) -> Range<usize> {
        if !spread.is_finite() {
            return 0..n;
        }
        let centre = (p as f64 + f64::from(self.anchor)) + self.linear / (2.0 * self.quadratic);
        let nearest = centre.round().clamp(0.0, n as f64 - 1.0);
        let away = nearest - centre;
        let half = (f64::from(spread) / self.quadratic + away * away).sqrt() + SLACK;
        let first = (centre - half).ceil().max(0.0) as usize;
        let end = ((centre + half).floor() + 1.0).max(0.0) as usize;
        first.min(n)..end.min(n)
    }
}
