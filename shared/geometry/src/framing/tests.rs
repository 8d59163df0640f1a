//! Tests that the framed camera and the framed picture agree, for any lens and roll.

use nalgebra::Point2;
use proptest::prelude::*;

use crate::{
    LensModel,
    testing::{camera, distance, lens_model, point, ring, ring_rig, z_up},
};

use super::*;

fn apply(m: &[[f64; 3]; 2], p: &Point2<f64>) -> Point2<f64> {
    let row = |r: [f64; 3]| r[0] * p.x + r[1] * p.y + r[2];
    Point2::new(row(m[0]), row(m[1]))
}

fn out_size() -> impl Strategy<Value = OutSize> {
    prop_oneof![
        (0.1..2.0).prop_map(OutSize::Scale),
        (50_u32..900, 50_u32..900).prop_map(|(w, h)| OutSize::Exact([w, h])),
    ]
}

proptest! {
    #[test]
    fn the_framed_camera_projects_where_the_framed_picture_shows_the_point(
        camera in camera(), point in point(), size in out_size(),
        roll in prop_oneof![Just(0.0), -3.1..3.1], offset in prop_oneof![Just(None), Just(Some([7, 3]))],
    ) {
        let source_size = if offset.is_some() { [600, 470] } else { [640, 480] };
        let framing = Framing::new(&camera, source_size, offset, size, roll).expect("sizes fit");
        if let (Some(in_source), Some(in_output)) = (camera.project(&point), framing.camera().project(&point)) {
            let [left, top] = offset.unwrap_or([0, 0]).map(f64::from);
            let mapped = apply(&framing.source_from_output(), &in_output);
            let expect = Point2::new(in_source.x - left, in_source.y - top);
            prop_assert!(distance(&mapped, &expect) < 1e-8, "{mapped} is not {expect}");
        }
    }

    #[test]
    fn an_upright_frame_shows_the_up_direction_as_vertical(model in lens_model(), extra in -1.4..1.4) {
        let mut cameras = ring(3, model);
        for camera in &mut cameras {
            camera.intrinsics.fy *= 1.07;
            camera.camera_from_world = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), extra) * camera.camera_from_world;
        }
        let rig = Rig::new(cameras, Some(z_up()), "planted").expect("a rig");
        for camera in rig.cameras() {
            let roll = upright_roll(camera, &rig).expect("up is known");
            let framing = Framing::new(camera, [640, 480], None, OutSize::Scale(0.5), roll).expect("sizes fit");
            let image = |z: f64| framing.camera().project(&Point3::new(0.0, 0.0, z));
            if let (Some(low), Some(high)) = (image(-0.5), image(0.5)) {
                prop_assert!((low.x - high.x).abs() < 1e-8 && high.y < low.y - 10.0, "{low} {high}");
            }
        }
    }

    #[test]
    fn the_picture_turns_about_the_principal_point(camera in camera(), size in out_size(), roll in -3.0..3.0) {
        let turned = Framing::new(&camera, [640, 480], None, size, roll).expect("sizes fit");
        let intrinsics = &turned.camera().intrinsics;
        let centre = apply(&turned.source_from_output(), &Point2::new(intrinsics.cx, intrinsics.cy));
        prop_assert!(distance(&centre, &Point2::new(camera.intrinsics.cx, camera.intrinsics.cy)) < 1e-9);
    }
}

#[test]
fn scaling_by_a_quarter_keeps_pixel_edges_aligned() {
    let mut camera = ring(1, LensModel::Pinhole).remove(0);
    camera.intrinsics.size = [1088, 1920];
    let framing = Framing::new(
        &camera,
        [1080, 1920],
        Some([0, 0]),
        OutSize::Exact([272, 480]),
        0.0,
    )
    .expect("sizes fit");
    assert_eq!(
        framing.source_from_output(),
        [[4.0, 0.0, 1.5], [0.0, 4.0, 1.5]]
    );
    assert_eq!(framing.camera().intrinsics.fx, 175.0);
    assert_eq!(framing.camera().intrinsics.fy, 705.0 / 4.0);
    assert!((framing.camera().intrinsics.cx - ((320.0 + 0.5) / 4.0 - 0.5)).abs() < 1e-12);
}

#[test]
fn an_unchanged_framing_is_exactly_the_identity() {
    let mut camera = ring(1, LensModel::Pinhole).remove(0);
    camera.intrinsics.cx = 318.973_693_843_75;
    let framing =
        Framing::new(&camera, [640, 480], None, OutSize::Scale(1.0), 0.0).expect("sizes fit");
    assert_eq!(
        framing.source_from_output(),
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    );
    assert_eq!(framing.out_size(), [640, 480]);
}

#[test]
fn another_aspect_ratio_is_padded_evenly() {
    let camera = ring(1, LensModel::Pinhole).remove(0);
    let framing = Framing::new(&camera, [640, 480], None, OutSize::Exact([320, 320]), 0.0)
        .expect("sizes fit");
    // Half of 480 rows is 240, so 40 rows of padding are above and below.
    assert_eq!(framing.source_from_output()[1], [0.0, 2.0, -79.5]);
}

#[test]
fn a_source_of_another_size_is_refused_with_both_sizes() {
    let camera = ring(1, LensModel::Pinhole).remove(0);
    let size = OutSize::Scale(1.0);
    let error = Framing::new(&camera, [1280, 960], None, size, 0.0).expect_err("twice the size");
    assert_eq!(
        error.to_string(),
        "the source is 1280x960 px, but the camera is calibrated for 640x480 px"
    );
    let error =
        Framing::new(&camera, [640, 480], Some([1, 0]), size, 0.0).expect_err("one column out");
    assert!(
        matches!(error, FramingError::SourceOffset { .. }),
        "{error}"
    );
    let error = Framing::new(&camera, [u32::MAX, 480], Some([u32::MAX, 0]), size, 0.0)
        .expect_err("far out");
    assert!(
        matches!(error, FramingError::SourceOffset { .. }),
        "{error}"
    );
}

#[test]
fn invalid_output_sizes_and_rolls_are_refused() {
    let camera = ring(1, LensModel::Pinhole).remove(0);
    let plan = |size, roll| Framing::new(&camera, [640, 480], None, size, roll);
    for size in [
        OutSize::Scale(0.0),
        OutSize::Scale(f64::NAN),
        OutSize::Scale(1e6),
        OutSize::Scale(-1.0),
        OutSize::Exact([0, 5]),
    ] {
        assert!(
            matches!(plan(size, 0.0), Err(FramingError::OutSize { .. })),
            "{size:?}"
        );
    }
    assert!(matches!(
        plan(OutSize::Scale(1.0), f64::NAN),
        Err(FramingError::Roll { .. })
    ));
}

#[test]
fn there_is_no_upright_roll_if_up_is_unknown_or_along_the_axis() {
    let cameras = ring(2, LensModel::Pinhole);
    let unknown = Rig::new(cameras.clone(), None, "").expect("a rig");
    assert_eq!(upright_roll(&cameras[0], &unknown), None);
    let along = Rig::new(cameras.clone(), Some(cameras[0].axis_in_world()), "").expect("a rig");
    assert_eq!(upright_roll(&cameras[0], &along), None);
}

#[test]
fn a_single_camera_is_rotated_upright_too() {
    let rig = ring_rig(1, LensModel::Pinhole);
    let mut camera = rig.cameras()[0].clone();
    camera.camera_from_world =
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.4) * camera.camera_from_world;
    let roll = upright_roll(&camera, &rig).expect("up is known");
    assert!((roll + 0.4).abs() < 0.02, "{roll}");
}
