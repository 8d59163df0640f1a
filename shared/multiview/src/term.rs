//! The geometric term between one part of the view being solved and its fixed counterpart.

use nalgebra::{Matrix3, Vector3};

use crate::ViewPlan;

/// Squared distance that stands for "the lens model has no answer here", cells^2.
const UNSEEN: f64 = 1e6;

/// The geometry of an ordered pair of views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epipolar {
    /// Line in the second view of a point in the first, both in undistorted pixels.
    pub second_from_first: Matrix3<f64>,
}

impl Epipolar {
    /// From the cameras of the two frames.
    pub fn new(first: &ViewPlan, second: &ViewPlan) -> Self {
        Self {
            second_from_first: geometry::epipolar::fundamental(first.camera(), second.camera()),
        }
    }

    /// Line in the support view of a point in the target view.
    pub(crate) fn support_from_target(&self, target_is_first: bool) -> Matrix3<f64> {
        if target_is_first {
            self.second_from_first
        } else {
            self.second_from_first.transpose()
        }
    }
}

/// The term `xi` of eq. 4 as a function of the target's position, for a fixed support.
///
/// With `r = q' F p`: the squared distances of `p` from the line of `q`, and of `q` from the line of
/// `p`, are `r^2 / |F'q|^2` and `r^2 / |Fp|^2` (norms of the first two components), each divided by
/// the squared cell size of its own view.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    support_from_target: Matrix3<f64>,
    /// Line of the support in the target view.
    line: Vector3<f64>,
    /// `1 / (n^2)` of that line.
    inverse_norm2: f64,
    support_scale2: f64,
    max_distance2: f64,
}

impl Term {
    /// The term of a support at `support_px` (undistorted), or `None` if it says nothing.
    pub(crate) fn new(
        support_from_target: Matrix3<f64>,
        support_px: [f64; 2],
        support_scale: f64,
        max_distance_cells: f64,
    ) -> Option<Self> {
        let support = Vector3::new(support_px[0], support_px[1], 1.0);
        let line = support_from_target.tr_mul(&support);
        let inverse_norm2 = 1.0 / (line.x * line.x + line.y * line.y);
        inverse_norm2.is_finite().then_some(Self {
            support_from_target,
            line,
            inverse_norm2,
            support_scale2: support_scale * support_scale,
            max_distance2: max_distance_cells * max_distance_cells,
        })
    }

    /// Sum of the two squared distances for a target at `target_px` (undistorted), cells^2.
    #[inline]
    pub(crate) fn distance2(&self, target_px: [f64; 2], target_scale2: f64) -> f64 {
        let [x, y] = target_px;
        let r = self.line.x * x + self.line.y * y + self.line.z;
        let f = &self.support_from_target;
        let mx = f[(0, 0)] * x + f[(0, 1)] * y + f[(0, 2)];
        let my = f[(1, 0)] * x + f[(1, 1)] * y + f[(1, 2)];
        let r2 = r * r;
        let in_target = r2 * self.inverse_norm2 / target_scale2;
        let in_support = r2 / ((mx * mx + my * my) * self.support_scale2);
        // `min` also turns the NaN of an unseen cell, and of the epipole, into the cap.
        let cap = self.max_distance2.min(UNSEEN);
        in_target.min(cap) + in_support.min(cap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cameras side by side: the line of a point is its own row.
    fn side_by_side() -> Matrix3<f64> {
        Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0)
    }

    #[test]
    fn a_point_on_the_line_costs_nothing() {
        let term = Term::new(side_by_side(), [50.0, 30.0], 4.0, f64::INFINITY).unwrap();
        assert_eq!(term.distance2([7.0, 30.0], 16.0), 0.0);
    }

    #[test]
    fn distances_count_in_cells_of_their_own_view() {
        let term = Term::new(side_by_side(), [50.0, 30.0], 4.0, f64::INFINITY).unwrap();
        // 8 pixels are 2 cells of the support (4 px) and 4 cells of the target (2 px).
        let got = term.distance2([7.0, 38.0], 4.0);
        assert!((got - (4.0 + 16.0)).abs() < 1e-12, "{got}");
    }

    #[test]
    fn the_cap_bounds_either_direction() {
        let term = Term::new(side_by_side(), [50.0, 30.0], 4.0, 3.0).unwrap();
        let got = term.distance2([7.0, 38.0], 4.0);
        assert!((got - (4.0 + 9.0)).abs() < 1e-12, "{got}");
    }

    #[test]
    fn an_unseen_cell_is_far_but_finite() {
        let term = Term::new(side_by_side(), [50.0, 30.0], 4.0, f64::INFINITY).unwrap();
        assert_eq!(term.distance2([f64::NAN; 2], 4.0), 2.0 * UNSEEN);
    }

    #[test]
    fn an_unseen_support_says_nothing() {
        assert!(Term::new(side_by_side(), [f64::NAN; 2], 4.0, 3.0).is_none());
    }
}
