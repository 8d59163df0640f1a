//! The geometric term between one part of the view being solved and its fixed counterpart.

use nalgebra::{Matrix3, Vector3};

use crate::ViewPlan;

/// Squared distance that is assumed if the lens model has no solution, in cells^2.
const UNSEEN: f64 = 1e6;

/// The geometry of an ordered pair of views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Epipolar {
    /// Maps a point in the first view to its line in the second view, both in undistorted pixels.
    pub second_from_first: Matrix3<f64>,
}

impl Epipolar {
    /// Creates the geometry from the cameras of the two frames.
    pub fn new(first: &ViewPlan, second: &ViewPlan) -> Self {
        Self {
            second_from_first: geometry::epipolar::fundamental(first.camera(), second.camera()),
        }
    }

    /// Maps a point in the target view to its line in the support view.
    pub(crate) fn support_from_target(&self, target_is_first: bool) -> Matrix3<f64> {
        if target_is_first {
            self.second_from_first
        } else {
            self.second_from_first.transpose()
        }
    }
}

/// The term `xi` of eq. 4, negated, as a function of the target's position, for a fixed support.
///
/// With `r = q' F p`, the squared distances of `p` from the line of `q`, and of `q` from the line of
/// `p`, are `r^2 / |F'q|^2` and `r^2 / |Fp|^2` (norms of the first two components). Each is divided
/// by the squared cell size of its own view. The paper's alpha, which weighs pixels, then has
/// the same effect at every level of the pyramid and at every resolution of the cameras.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Term {
    support_from_target: Matrix3<f64>,
    /// Line of the support in the target view.
    line: Vector3<f64>,
    /// `1 / (n^2)`, where `n` is the norm of the line's first two components.
    inverse_norm2: f64,
    support_scale2: f64,
    /// Cap of each squared distance, in cells^2.
    cap: f64,
}

impl Term {
    /// Creates the term of a support at `support_px` (undistorted). `None` if the support has no line, because it lies on the epipole or
    /// because the camera centres coincide.
    pub(crate) fn new(
        support_from_target: Matrix3<f64>,
        support_px: [f64; 2],
        support_scale: f64,
        max_distance_cells: f64,
    ) -> Option<Self> {
        let support = Vector3::new(support_px[0], support_px[1], 1.0);
        let line = support_from_target.tr_mul(&support);
        let inverse_norm2 = 1.0 / (line.x * line.x + line.y * line.y);
        (!inverse_norm2.is_infinite()).then_some(Self {
            support_from_target,
            line,
            inverse_norm2,
            support_scale2: support_scale * support_scale,
            cap: (max_distance_cells * max_distance_cells).min(UNSEEN),
        })
    }

    /// Returns true if the term is the same at every target position: the lens model has no solution for the support.
    pub(crate) fn is_constant(&self) -> bool {
        self.inverse_norm2.is_nan()
    }

    /// Returns the sum of the two squared distances for a target at `target_px` (undistorted), in cells^2.
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
        // `min` also replaces NaN by the cap; NaN occurs at the epipole, and at positions for which the lens model has no solution.
        in_target.min(self.cap) + in_support.min(self.cap)
    }
}

#[cfg(test)]
mod tests {
    use geometry::{Camera, Intrinsics, Lens, LensModel};
    use nalgebra::{Isometry3, Point2, Vector2};

    use super::*;

    /// Two cameras side by side: the line of a point is its own row.
    fn side_by_side() -> Matrix3<f64> {
        Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0)
    }

    #[test]
    fn a_point_on_the_epipolar_line_costs_nothing() {
        let term = Term::new(side_by_side(), [50.0, 30.0], 4.0, f64::INFINITY).unwrap();
        assert_eq!(term.distance2([7.0, 30.0], 16.0), 0.0);
    }

    #[test]
    fn distances_are_measured_in_cells_of_their_own_view() {
        let term = Term::new(side_by_side(), [50.0, 30.0], 4.0, f64::INFINITY).unwrap();
        // 8 pixels are 2 cells in the support view (4 px each) and 4 cells in the target view (2 px each).
        let got = term.distance2([7.0, 38.0], 4.0);
        assert!((got - (4.0 + 16.0)).abs() < 1e-12, "{got}");
    }

    #[test]
    fn the_maximum_applies_to_the_distance_in_each_direction() {
        let term = Term::new(side_by_side(), [50.0, 30.0], 4.0, 3.0).unwrap();
        let got = term.distance2([7.0, 38.0], 4.0);
        assert!((got - (4.0 + 9.0)).abs() < 1e-12, "{got}");
    }

    #[test]
    fn a_cell_that_cannot_be_undistorted_has_a_large_finite_distance() {
        let term = Term::new(side_by_side(), [50.0, 30.0], 4.0, f64::INFINITY).unwrap();
        assert_eq!(term.distance2([f64::NAN; 2], 4.0), 2.0 * UNSEEN);
    }

    #[test]
    fn a_support_that_cannot_be_undistorted_has_the_same_distance_everywhere() {
        let term = Term::new(side_by_side(), [f64::NAN; 2], 4.0, 3.0).unwrap();
        assert!(term.is_constant());
        assert_eq!(term.distance2([7.0, 38.0], 4.0), 2.0 * 9.0);
    }

    #[test]
    fn a_support_without_a_line_has_no_term() {
        let in_one_place = Matrix3::zeros();
        assert!(Term::new(in_one_place, [50.0, 30.0], 4.0, 3.0).is_none());
    }

    fn distorted(name: &str, k1: f64, pose: Isometry3<f64>) -> Camera {
        let model = LensModel::BrownConrady {
            k: [k1, 0.1, 0.0, 0.0, 0.0, 0.0],
            p: [0.001, -0.002],
        };
        Camera {
            name: name.to_owned(),
            intrinsics: Intrinsics {
                fx: 300.0,
                fy: 310.0,
                cx: 160.0,
                cy: 120.0,
                size: [320, 240],
                lens: Lens::new(model),
            },
            camera_from_world: pose,
        }
    }

    #[test]
    fn the_term_vanishes_along_the_epipolar_curve_of_distorted_views() {
        let first = distorted("first", -0.3, Isometry3::identity());
        let turned = Isometry3::new(Vector3::new(-2.0, 0.1, 0.8), Vector3::new(0.0, 0.7, 0.1));
        let second = distorted("second", -0.25, turned);
        let second_from_first = geometry::epipolar::fundamental(&first, &second);
        let of_pixels = |p: Point2<f64>, q: Point2<f64>| {
            let term = Term::new(second_from_first, [q.x, q.y], 4.0, f64::INFINITY).unwrap();
            term.distance2([p.x, p.y], 16.0)
        };
        // A segment of the world that the second view projects to one point: 2 to 4 m along its
        // ray.
        let pixel = Point2::new(90.0, 60.0);
        let ray = second.ray(&pixel).unwrap();
        let ideal = second.undistorted_px(&pixel).unwrap();
        let mut without_lenses = 0.0_f64;
        for step in 0..=10 {
            let along = ray.direction.into_inner() * (2.0 + 0.2 * f64::from(step));
            let seen = first.project(&(ray.origin + along)).unwrap();
            let on_curve = of_pixels(first.undistorted_px(&seen).unwrap(), ideal);
            assert!(on_curve < 1e-12, "{on_curve}");
            let beside = first.undistorted_px(&(seen + Vector2::new(0.0, 4.0))).unwrap();
            assert!(of_pixels(beside, ideal) > 0.5, "a cell away");
            without_lenses = without_lenses.max(of_pixels(seen, pixel));
        }
        assert!(without_lenses > 0.5, "{without_lenses}");
    }
}
