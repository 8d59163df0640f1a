//! Tests that projection, its derivative and its inverse agree.

use proptest::prelude::*;

use crate::testing::{camera, distance, point};

use super::*;

proptest! {
    #[test]
    fn the_ray_of_a_pixel_goes_through_its_point(camera in camera(), point in point()) {
        if let Some(pixel) = camera.project(&point) {
            let ray = camera.ray(&pixel).expect("inside the lens");
            let distance = (point - ray.origin).cross(&ray.direction).norm();
            prop_assert!(distance < 1e-7, "{distance} m");
        }
    }

    #[test]
    fn ideal_pixels_are_those_of_the_pinhole_projection(camera in camera(), point in point()) {
        if let Some(pixel) = camera.project(&point) {
            let ideal = camera.undistorted_px(&pixel).expect("inside the lens");
            let expect = Point2::from_homogeneous(camera.image_from_world() * point.to_homogeneous()).expect("finite");
            prop_assert!(distance(&ideal, &expect) < 1e-5);
            prop_assert!(distance(&camera.distort_px(&ideal).expect("inside the lens"), &pixel) < 1e-6);
        }
    }

    #[test]
    fn the_jacobian_equals_the_numerical_derivative(camera in camera(), point in point()) {
        let Some((pixel, jacobian)) = camera.project_with_jacobian(&point) else { return Ok(()) };
        prop_assert_eq!(Some(pixel), camera.project(&point));
        for axis in 0..3 {
            let step = Vector3::ith(axis, 1e-6);
            if let (Some(plus), Some(minus)) = (camera.project(&(point + step)), camera.project(&(point - step))) {
                let numeric = (plus - minus) / 2e-6;
                prop_assert!((numeric - jacobian.column(axis)).norm() < 1e-3 * (1.0 + numeric.norm()));
            }
        }
    }

    #[test]
    fn the_centre_is_the_origin_of_the_camera(camera in camera()) {
        prop_assert!((camera.camera_from_world * camera.centre_in_world()).coords.norm() < 1e-12);
    }

    #[test]
    fn a_point_behind_the_camera_has_no_image(camera in camera(), point in point()) {
        let mirrored = camera.centre_in_world() + (camera.centre_in_world() - point);
        prop_assert_eq!(camera.project(&mirrored), None);
    }
}
