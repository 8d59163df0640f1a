//! Tests of the cameras that a rig refuses, and of the point where its optical axes meet.

use nalgebra::Quaternion;
use proptest::prelude::*;

use crate::{
    Lens, LensModel,
    testing::{looking_at_origin, ring, ring_rig, z_up},
};

use super::*;

/// Returns the error of a rig after `spoil` changed its second camera.
fn refusal(spoil: impl FnOnce(&mut Camera)) -> RigError {
    let mut cameras = ring(2, LensModel::Pinhole);
    spoil(&mut cameras[1]);
    Rig::new(cameras, None, "").expect_err("must be refused")
}

#[test]
fn refuses_no_cameras() {
    assert_eq!(Rig::new(Vec::new(), None, ""), Err(RigError::NoCameras));
}

#[test]
fn refuses_empty_and_repeated_names() {
    assert_eq!(
        refusal(|c| c.name.clear()),
        RigError::EmptyName { index: 1 }
    );
    assert_eq!(
        refusal(|c| c.name = "cam0".to_owned()),
        RigError::DuplicateName {
            name: "cam0".to_owned()
        }
    );
}

#[test]
fn refuses_names_that_leave_a_folder_or_break_a_line() {
    let long = "c".repeat(65);
    for name in [
        "../x", "..", ".", "/", "a/b", "a\\b", "a\nb", "a,b", " a", "\0", &long,
    ] {
        let expected = RigError::Name {
            index: 1,
            name: name.to_owned(),
        };
        assert_eq!(refusal(|c| c.name = name.to_owned()), expected);
    }
    for name in [
        "C1",
        "int_cam-2.img",
        "Kamera (links)",
        "caméra 3",
        "21:09+x#1",
    ] {
        assert!(is_plain_name(name), "{name}");
    }
}

#[test]
fn refuses_numbers_that_are_not_finite() {
    let nan = LensModel::KannalaBrandt {
        k: [0.0, f64::NAN, 0.0, 0.0],
    };
    for error in [
        refusal(|c| c.intrinsics.cy = f64::INFINITY),
        refusal(|c| c.camera_from_world.translation.x = f64::NAN),
        refusal(|c| c.intrinsics.lens = Lens::new(nan)),
    ] {
        assert!(matches!(error, RigError::NotFinite { .. }), "{error}");
    }
}

#[test]
fn refuses_empty_images_and_impossible_lenses() {
    assert!(matches!(
        refusal(|c| c.intrinsics.size = [640, 0]),
        RigError::EmptyImage { size: [640, 0], .. }
    ));
    assert!(matches!(
        refusal(|c| c.intrinsics.fy = -700.0),
        RigError::Focal { value: -700.0, .. }
    ));
    assert!(matches!(
        refusal(|c| c.intrinsics.cx = 20_480.0),
        RigError::PrincipalPoint {
            quantity: "cx",
            extent: 640,
            ..
        }
    ));
}

#[test]
fn refuses_a_quaternion_that_is_not_of_unit_length() {
    let long = Quaternion::new(1.1, 0.0, 0.0, 0.0);
    let error = refusal(|c| c.camera_from_world.rotation = UnitQuaternion::new_unchecked(long));
    assert!(matches!(error, RigError::Rotation { .. }), "{error}");
}

#[test]
fn refuses_mirrors_and_scales_as_rotations() {
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
    assert_eq!(
        rotation_from_matrix(&mirror).expect_err("a mirror").determinant,
        -1.0
    );
    let scaled = Matrix3::identity() * 1.01;
    assert!(rotation_from_matrix(&scaled).expect_err("a scale").deviation > 0.02);
    rotation_from_matrix(&Matrix3::from_element(f64::NAN)).expect_err("no numbers");
}

proptest! {
    #[test]
    fn a_rotation_written_with_six_digits_is_read_back(bearing in 0.0..6.3, roll in -3.1..3.1) {
        let rotation = looking_at_origin(bearing, 4.0, 1.0, roll).rotation;
        let written = rotation.to_rotation_matrix().matrix().map(|c| (c * 1e6).round() / 1e6);
        let read = rotation_from_matrix(&written).expect("a rotation");
        prop_assert!(read.angle_to(&rotation) < 2e-6);
    }
}

#[test]
fn the_focus_of_cameras_that_look_at_one_point_is_that_point() {
    let focus = ring_rig(4, LensModel::Pinhole).focus().expect("axes meet");
    assert!(focus.coords.norm() < 1e-12, "{focus}");
}

#[test]
fn parallel_cameras_have_no_focus() {
    let mut cameras = ring(2, LensModel::Pinhole);
    cameras[1].camera_from_world = cameras[0].camera_from_world;
    cameras[1].camera_from_world.translation.x += 1.0;
    assert_eq!(
        Rig::new(cameras, Some(z_up()), "").expect("a rig").focus(),
        None
    );
    assert_eq!(ring_rig(1, LensModel::Pinhole).focus(), None);
}
