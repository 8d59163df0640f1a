//! Tests that distorting and undistorting are inverse to each other within the valid range of a lens, and give no result outside it.

use proptest::prelude::*;

use super::*;
use crate::testing::{lens, lens_model};

fn brown(k1: f64, k2: f64) -> Lens {
    Lens::new(LensModel::BrownConrady {
        k: [k1, k2, 0.0, 0.0, 0.0, 0.0],
        p: [0.0; 2],
    })
}

proptest! {
    #[test]
    fn undistorting_inverts_distorting(lens in lens(), radius in 0.0..1.2, bearing in 0.0..6.3) {
        let point = Point2::new(radius * f64::cos(bearing), radius * f64::sin(bearing));
        // Close to the turning point the inverse is ill-conditioned, so the test stays 1 % inside.
        prop_assume!(radius < 0.99 * lens.max_radius());
        let Some(distorted) = lens.distort(&point) else { return Ok(()) };
        let back = lens.undistort(&distorted).expect("a distorted point can be undistorted");
        prop_assert!((back - point).norm() < 1e-8, "{back} is not {point}");
    }

    #[test]
    fn distorting_inverts_undistorting(lens in lens(), x in -1.5..1.5, y in -1.5..1.5) {
        let wanted = Point2::new(x, y);
        if let Some(point) = lens.undistort(&wanted) {
            let reached = lens.distort(&point).expect("inside the valid range");
            prop_assert!((reached - wanted).norm() < 1e-9);
        }
    }

    #[test]
    fn the_jacobian_equals_the_numerical_derivative(lens in lens(), x in -0.5..0.5, y in -0.5..0.5) {
        let step = 1e-6;
        let at = |x: f64, y: f64| lens.distort(&Point2::new(x, y));
        let Some((_, jacobian)) = lens.distort_with_jacobian(&Point2::new(x, y)) else { return Ok(()) };
        if let (Some(e), Some(w), Some(s), Some(n)) = (at(x + step, y), at(x - step, y), at(x, y + step), at(x, y - step)) {
            let numeric = Matrix2::from_columns(&[(e - w) / (2.0 * step), (s - n) / (2.0 * step)]);
            prop_assert!((numeric - jacobian).norm() < 1e-7, "{numeric} is not {jacobian}");
        }
    }

    #[test]
    fn the_radius_grows_up_to_the_limit(model in lens_model()) {
        let limit = Lens::new(model).max_radius();
        let radii: Vec<f64> = (0..=100).map(|i| model.radius(limit * f64::from(i) / 100.0).0).collect();
        prop_assert!(radii.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn rotating_a_lens_rotates_its_picture(model in lens_model(), angle in -3.0..3.0, x in -0.4..0.4, y in -0.4..0.4) {
        let turn = nalgebra::Rotation2::new(angle);
        let point = Point2::new(x, y);
        let (plain, turned) = (Lens::new(model), Lens::new(model.rotated(angle)));
        if let (Some(before), Some(after)) = (plain.distort(&point), turned.distort(&(turn * point))) {
            prop_assert!((turn * before - after).norm() < 1e-12);
        }
    }
}

#[test]
fn a_barrel_lens_ends_where_its_polynomial_stops_growing() {
    // d/dr (r - 0.3 r³) = 0 at r = sqrt(1 / 0.9).
    let lens = brown(-0.3, 0.0);
    let turning = (1.0_f64 / 0.9).sqrt();
    assert!(
        (lens.max_radius() - turning).abs() < 1e-9,
        "{}",
        lens.max_radius()
    );
    assert!(lens.distort(&Point2::new(turning * 1.001, 0.0)).is_none());
    assert!(lens.undistort(&Point2::new(turning * 2.0 / 3.0 * 1.001, 0.0)).is_none());
    assert!(lens.undistort(&Point2::new(turning * 2.0 / 3.0 * 0.999, 0.0)).is_some());
}

#[test]
fn the_lenses_of_humaneva_and_umpm_are_monotonic_beyond_60_degrees() {
    for lens in [
        brown(-0.289415, 0.105962),
        brown(-0.4, 0.106),
        brown(-0.34, 0.106),
        brown(-0.383, 0.159),
    ] {
        assert!(lens.max_radius() > 1.73, "{lens:?}");
    }
}

#[test]
fn a_pole_of_the_rational_model_ends_its_range() {
    let lens = Lens::new(LensModel::BrownConrady {
        k: [0.0, 0.0, 0.0, -0.5, 0.0, 0.0],
        p: [0.0; 2],
    });
    assert!(lens.max_radius() < 2.0_f64.sqrt());
}

#[test]
fn brown_conrady_equals_the_formula_of_opencv() {
    // The expected values follow the formula of `cv::projectPoints` at (0.3, -0.2).
    let lens = Lens::new(LensModel::BrownConrady {
        k: [0.1, -0.2, 0.3, 0.0, 0.0, 0.0],
        p: [0.01, 0.02],
    });
    let (r2, xy): (f64, f64) = (0.13, -0.06);
    let radial = 1.0 + 0.1 * r2 - 0.2 * r2 * r2 + 0.3 * r2.powi(3);
    let expect = Point2::new(
        0.3 * radial + 2.0 * 0.01 * xy + 0.02 * (r2 + 2.0 * 0.09),
        -0.2 * radial + 0.01 * (r2 + 2.0 * 0.04) + 2.0 * 0.02 * xy,
    );
    assert!((lens.distort(&Point2::new(0.3, -0.2)).expect("inside") - expect).norm() < 1e-15);
}

#[test]
fn points_that_are_not_finite_are_refused() {
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(brown(-0.1, 0.0).distort(&Point2::new(bad, 0.0)), None);
        assert_eq!(brown(-0.1, 0.0).undistort(&Point2::new(0.0, bad)), None);
        assert_eq!(Lens::default().undistort(&Point2::new(0.0, bad)), None);
    }
}
