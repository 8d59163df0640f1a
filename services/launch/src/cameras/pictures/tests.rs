//! Tests of the rotation that a calibration requires, and of the frame numbers of pictures.

use geometry::{Camera, Intrinsics, Lens};
use nalgebra::{Isometry3, UnitQuaternion};

use super::*;

/// Returns a rig with one camera that looks along y, with z up, rolled to the right by `roll` degrees.
fn rig(size: [u32; 2], roll: f64, up: Option<UnitVector3<f64>>) -> Rig {
    let level = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::FRAC_PI_2);
    let rolled = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -roll.to_radians());
    let camera = |name: &str, along: f64, turn: UnitQuaternion<f64>| Camera {
        name: name.to_owned(),
        intrinsics: Intrinsics {
            fx: 500.0,
            fy: 500.0,
            cx: f64::from(size[0]) / 2.0,
            cy: f64::from(size[1]) / 2.0,
            size,
            lens: Lens::default(),
        },
        camera_from_world: Isometry3::from_parts(Vector3::new(along, 0.0, 4.0).into(), turn),
    };
    let cameras = vec![
        camera("rolled", 0.0, rolled * level),
        camera("b", 1.0, level),
        camera("c", 2.0, level),
        camera("d", 3.0, level),
    ];
    Rig::new(cameras, up, "").unwrap()
}

fn turns(rig: Rig, stored: [usize; 2], degrees: u32) -> bool {
    let stored = Size::new(stored[0], stored[1]);
    let tag = Turn::clockwise(degrees).unwrap();
    by_calibration("rolled", &with_up(rig), stored, tag).0
}

#[test]
fn the_calibration_decides_whether_the_orientation_tag_is_applied() {
    let up = Some(Vector3::z_axis());
    for degrees in [90, 270] {
        assert!(turns(rig([480, 640], 0.0, up), [640, 480], degrees));
        assert!(!turns(rig([640, 480], 0.0, up), [640, 480], degrees));
        // If the calibrated picture is cropped or has another size, its aspect ratio shows if it was rotated.
        assert!(turns(rig([480, 600], 0.0, up), [640, 480], degrees));
        assert!(turns(rig([480, 480], 0.0, up), [480, 480], degrees));
        assert!(!turns(rig([480, 480], 90.0, up), [480, 480], degrees));
    }
    for up in [up, None] {
        assert!(turns(rig([640, 480], 10.0, up), [640, 480], 180));
        assert!(!turns(rig([640, 480], 180.0, up), [640, 480], 180));
    }
}

#[test]
fn gaps_are_described_by_their_frames() {
    let counted = PictureNumbers { first: 10, step: 5 };
    assert_eq!(gaps(&[10, 15, 20], counted), None);
    let text = gaps(&[15, 20, 30, 55], counted).unwrap();
    assert!(
        text.starts_with("5 of 9 frames: no file name has the numbers 3, 5 to 8"),
        "{text}"
    );
}
