//! Tests that the images of one point in two cameras are on each other's epipolar lines and curves.

use proptest::prelude::*;

use crate::{
    LensModel,
    testing::{camera, distance, point, ring},
};

use super::*;

proptest! {
    #[test]
    fn images_of_one_point_lie_on_the_epipolar_lines_of_each_other(a in camera(), b in camera(), point in point()) {
        prop_assume!((a.centre_in_world() - b.centre_in_world()).norm() > 0.1);
        if let (Some(in_a), Some(in_b)) = (a.project(&point), b.project(&point)) {
            let (in_a, in_b) = (a.undistorted_px(&in_a).expect("inside"), b.undistorted_px(&in_b).expect("inside"));
            let distances = symmetric_distance(&fundamental(&a, &b), &in_a, &in_b).expect("no epipole");
            prop_assert!(distances.iter().all(|d| *d < 1e-4), "{distances:?}");
        }
    }

    #[test]
    fn swapping_the_cameras_transposes_the_fundamental_matrix(a in camera(), b in camera()) {
        prop_assume!((a.centre_in_world() - b.centre_in_world()).norm() > 0.1);
        let (there, back) = (fundamental(&a, &b), fundamental(&b, &a).transpose());
        prop_assert!((there - back).norm().min((there + back).norm()) < 1e-9);
    }

    #[test]
    fn the_curve_passes_through_the_image_of_every_point_of_its_ray(a in camera(), b in camera(), point in point()) {
        prop_assume!((a.centre_in_world() - b.centre_in_world()).norm() > 1.0);
        let (Some(in_a), Some(in_b)) = (a.project(&point), b.project(&point)) else { return Ok(()) };
        prop_assume!((1.0..638.0).contains(&in_b.x) && (1.0..478.0).contains(&in_b.y));
        let curve = epipolar_curve(&a, &b, &in_a, 400);
        let nearest = curve.iter().map(|p| distance(p, &in_b)).fold(f64::INFINITY, f64::min);
        let longest = curve.windows(2).map(|w| distance(&w[0], &w[1])).fold(0.0, f64::max);
        prop_assert!(nearest <= longest + 1e-3, "{nearest} px away, steps of {longest} px");
    }
}

#[test]
fn the_curve_stays_in_the_image_and_reaches_its_border() {
    let cameras = ring(
        2,
        LensModel::BrownConrady {
            k: [-0.29, 0.1, 0.0, 0.0, 0.0, 0.0],
            p: [0.001, 0.0],
        },
    );
    let curve = epipolar_curve(&cameras[0], &cameras[1], &Point2::new(300.0, 200.0), 50);
    assert_eq!(curve.len(), 50);
    let inside = |p: &Point2<f64>| (-0.5..=639.5).contains(&p.x) && (-0.5..=479.5).contains(&p.y);
    assert!(curve.iter().all(inside));
    for end in [curve[0], curve[49]] {
        let margin = (end.x + 0.5).min(639.5 - end.x).min(end.y + 0.5).min(479.5 - end.y);
        assert!(margin < 1e-6, "{end} is {margin} px from the border");
    }
}

#[test]
fn cameras_at_the_same_position_have_no_epipolar_geometry() {
    let camera = &ring(1, LensModel::Pinhole)[0];
    let f = fundamental(camera, camera);
    assert_eq!(f, Matrix3::zeros());
    assert_eq!(epipolar_line(&f, &Point2::new(1.0, 2.0)), None);
    assert!(epipolar_curve(camera, camera, &Point2::new(1.0, 2.0), 10).is_empty());
}

#[test]
fn a_distance_is_in_pixels() {
    let line = epipolar_line(
        &Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, -2.0, 0.0, 0.0, 20.0),
        &Point2::origin(),
    );
    assert_eq!(
        point_line_distance(&line.expect("a line"), &Point2::new(5.0, 13.0)),
        3.0
    );
}
