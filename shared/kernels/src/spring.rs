//! The spring between a child and its parent, and the window that contains the best child.

use std::ops::Range;

/// A quadratic spring.
///
/// With the parent at cell `p` and the child at `v`, `d = p + anchor - v` and the spring adds
/// `-(w[0] d_x^2 + w[1] d_x + w[2] d_y^2 + w[3] d_y)` to the score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Weights of `[d_x^2, d_x, d_y^2, d_y]`; those of the squares are positive.
    pub w: [f64; 4],
    /// Offset `[x, y]` of the child at which `d` is zero, in cells.
    pub anchor: [i32; 2],
}

/// One axis of a [`Spring`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axis {
    pub(crate) quadratic: f64,
    pub(crate) linear: f64,
    pub(crate) anchor: i32,
}

/// Number of cells by which a window is wider than exact arithmetic requires. Together with the excess in
/// [`ScoreRange::spread`](crate::ScoreRange), it ensures that no candidate outside the window can reach the best score inside by rounding.
const SLACK: f64 = 1e-3;

/// The window of child positions that can be best for a parent, along one axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    n: usize,
    /// Best offset of the child from its parent, in cells.
    centre: f64,
    /// Square of the distance at which the cost of the spring equals the largest gain in score, in cells^2.
    square: f64,
    /// First and last offset to try if the best position is on the grid.
    first: isize,
    last: isize,
}

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
    /// Returns the score that the spring adds if the child is `offset` cells after its parent.
    ///
    /// The score is computed in double and rounded once, so that every caller adds the same number.
    #[inline(always)]
    pub(crate) fn score(self, offset: isize) -> f32 {
        let d = f64::from(self.anchor) - offset as f64;
        -(self.quadratic * d * d + self.linear * d) as f32
    }

    /// Returns the window that contains the best child of a parent, among `n` child positions in a row.
    ///
    /// * `spread`: largest difference between the scores of any two children. Let `c` be the best position of the spring, and `v0` the
    ///   nearest child to it. A child at `v` loses to `v0` if `quadratic ((v - c)^2 - (v0 - c)^2) > spread`. All winners are thus within
    ///   `sqrt(spread / quadratic + (v0 - c)^2)` of `c`. If `spread` is not finite, winners may be anywhere.
    pub(crate) fn reach(self, n: usize, spread: f32) -> Reach {
        let centre = f64::from(self.anchor) + self.linear / (2.0 * self.quadratic);
        let square = f64::from(spread) / self.quadratic;
        let away = centre.round() - centre;
        let half = (square + away * away).sqrt() + SLACK;
        Reach {
            n,
            centre,
            square,
            first: (centre - half).ceil().max(-(n as f64)) as isize,
            last: (centre + half).floor().min(n as f64) as isize,
        }
    }
}

impl Reach {
    /// The child positions that can be best for a parent at `p`.
    #[inline(always)]
    pub(crate) fn window(&self, p: usize) -> Range<usize> {
        let n = self.n as isize;
        let centre = p as f64 + self.centre;
        let (first, last) = if !self.square.is_finite() {
            (0, n)
        } else if centre >= 0.0 && centre <= (n - 1) as f64 {
            (p as isize + self.first, p as isize + self.last)
        } else {
            self.beside_the_grid(centre)
        };
        let first = first.clamp(0, n) as usize;
        first..((last + 1).clamp(0, n) as usize).max(first)
    }

    /// The offsets at which at least one parent position of a block can have its best child. For other positions of the block, such an
    /// offset may lead outside the grid, but never further than the length of the block.
    pub(crate) fn offsets(&self, block: Range<usize>) -> Range<isize> {
        let (p, last) = (block.start, block.end - 1);
        // From one parent to the next, each end of the window moves forward by at most one cell, and never back. The offsets of the ends
        // from the parent therefore never increase.
        let first = self.window(last).start as isize - last as isize;
        let end = self.window(p).end as isize - p as isize;
        first..end.max(first)
    }

    /// The first and last child of the window if the best position `centre` is outside the grid.
    #[inline(never)]
    fn beside_the_grid(&self, centre: f64) -> (isize, isize) {
        let nearest = centre.clamp(0.0, self.n as f64 - 1.0);
        let away = nearest - centre;
        let half = (self.square + away * away).sqrt() + SLACK;
        let first = (centre - half).ceil().clamp(0.0, nearest);
        let last = (centre + half).floor().clamp(nearest, self.n as f64 - 1.0);
        (first as isize, last as isize)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_child_outside_of_the_window_can_have_the_maximum(
            (n, p) in (1..60_usize).prop_flat_map(|n| (Just(n), 0..n)),
            (quadratic, linear) in (0.005..0.5, -0.5..0.5),
            anchor in -70..70_i32,
            spread in 0.0..3.0_f32,
        ) {
            let axis = Axis { quadratic, linear, anchor };
            let window = axis.reach(n, spread).window(p);
            prop_assert!(!window.is_empty() && window.end <= n);
            let score = |v: usize| axis.score(v as isize - p as isize);
            let most = window.clone().map(score).fold(f32::NEG_INFINITY, f32::max);
            for v in (0..n).filter(|v| !window.contains(v)) {
                prop_assert!(score(v) + spread < most + 1e-4);
            }
        }
    }

    proptest! {
        #[test]
        fn the_offsets_of_a_block_cover_all_its_windows(
            (n, first, len) in (1..60_usize).prop_flat_map(|n| (Just(n), 0..n, 1..17_usize)),
            (quadratic, linear) in (0.005..0.5, -0.5..0.5),
            anchor in -70..70_i32,
            spread in prop_oneof![9 => 0.0..3.0_f32, 1 => Just(f32::INFINITY)],
        ) {
            let axis = Axis { quadratic, linear, anchor };
            let (reach, block) = (axis.reach(n, spread), first..n.min(first + len));
            let offsets = reach.offsets(block.clone());
            for p in block.clone() {
                let window = reach.window(p);
                let window = window.start as isize - p as isize..window.end as isize - p as isize;
                prop_assert!(offsets.start <= window.start && window.end <= offsets.end);
            }
            let [first, last] = [block.start, block.end - 1].map(|cell| cell as isize);
            prop_assert!(offsets.start >= -last && offsets.end <= n as isize - first);
        }
    }

    #[test]
    fn extreme_springs_keep_the_window_on_the_grid() {
        for (quadratic, linear, anchor) in [(1e-9, 1e9, 1000), (1e-9, 0.0, 0), (1e9, -1e9, -1000)] {
            let axis = Axis {
                quadratic,
                linear,
                anchor,
            };
            for spread in [0.0, 1.0, f32::MAX, f32::INFINITY, f32::NAN] {
                for p in 0..5 {
                    let window = axis.reach(5, spread).window(p);
                    assert!(
                        !window.is_empty() && window.end <= 5,
                        "{axis:?} {spread} {window:?}"
                    );
                }
            }
        }
    }
}
