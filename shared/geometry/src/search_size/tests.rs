//! Tests of the sizes that follow from many kinds of rigs.

use std::path::Path;

use nalgebra::{Isometry3, Point3, Translation3, UnitVector3, Vector3};

use super::*;
use crate::files::{ReadOptions, read};
use crate::testing::{looking_at_origin, z_up};
use crate::{Camera, Intrinsics, Lens, LensModel};

fn camera(name: &str, size: [u32; 2], focal: f64, pose: Isometry3<f64>) -> Camera {
    let [width, height] = size.map(f64::from);
    Camera {
        name: name.to_owned(),
        intrinsics: Intrinsics {
            fx: focal,
            fy: focal,
            cx: width / 2.0 - 0.5,
            cy: height / 2.0 - 0.5,
            size,
            lens: Lens::new(LensModel::Pinhole),
        },
        camera_from_world: pose,
    }
}

/// Returns cameras evenly spaced on a circle, level with the middle of a person or above it, looking at the person.
fn ring(n: usize, size: [u32; 2], focal: f64, radius: f64, height: f64) -> Vec<Camera> {
    let cameras = (0..n).map(|nth| {
        let bearing = core::f64::consts::TAU * nth as f64 / n as f64;
        let pose = looking_at_origin(bearing, radius, height, 0.0);
        camera(&format!("c{nth}"), size, focal, pose)
    });
    cameras.collect()
}

fn rig(cameras: Vec<Camera>) -> Rig {
    Rig::new(cameras, Some(z_up()), "planted").unwrap()
}

/// Returns the heights of a person at the origin in frames of the chosen sizes, in pixels.
fn in_the_middle(rig: &Rig) -> Vec<f64> {
    let chosen = search_sizes(rig).cameras.into_iter().zip(rig.cameras());
    let px = chosen.map(|(size, camera)| {
        let half = PERSON_METRES / 2.0;
        let [head, feet] = [half, -half].map(|z| camera.project(&Point3::new(0.0, 0.0, z)));
        (head.unwrap() - feet.unwrap()).norm() * size.scale
    });
    px.collect()
}

fn shipped(name: &str) -> SearchSizes {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/rigs");
    search_sizes(&read(&folder.join(name), &ReadOptions::default()).unwrap())
}

#[test]
fn a_person_in_the_middle_of_a_ring_has_a_good_height_for_any_cameras() {
    // Image size, focal length, and distance from the origin.
    for (size, focal, radius) in [
        ([1920, 1080], 1400.0, 3.0),
        ([1920, 1080], 1000.0, 3.0),
        ([1080, 1920], 1500.0, 3.5),
        ([3840, 2160], 2800.0, 3.0),
        ([1280, 720], 900.0, 3.2),
        ([640, 480], 700.0, 4.5),
        ([640, 480], 600.0, 5.0),
        ([480, 270], 400.0, 3.6),
    ] {
        for n in [2, 3, 5, 8] {
            for height in [0.0, 1.5] {
                let rig = rig(ring(n, size, focal, radius, height));
                let px = in_the_middle(&rig);
                let is_good = px.iter().all(|px| (GOOD_PX[0]..=GOOD_PX[1]).contains(px));
                assert!(is_good, "{n} of {size:?} at {radius} m: {px:?}");
                assert_eq!(search_sizes(&rig).n_sharing, n);
            }
        }
    }
}

#[test]
fn a_ring_of_cameras_has_one_scale_with_or_without_an_up_direction() {
    for n in 3..=8 {
        let cameras = ring(n, [1080, 1920], 1500.0, 3.5, 1.0);
        let unknown = Rig::new(cameras.clone(), None, "planted").unwrap();
        for rig in [rig(cameras), unknown] {
            let chosen = search_sizes(&rig).cameras;
            assert!(chosen.iter().all(|camera| camera.scale == chosen[0].scale));
            let px = in_the_middle(&rig)[0];
            assert!((GOOD_PX[0]..=GOOD_PX[1]).contains(&px), "{n}: {px}");
        }
    }
}

#[test]
fn cameras_rotated_by_90_degrees_give_the_same_scale() {
    let upright = ring(4, [1920, 1080], 1400.0, 4.0, 1.0);
    let rolled = upright.iter().map(|upright| Camera {
        camera_from_world: Isometry3::rotation(Vector3::z() * core::f64::consts::FRAC_PI_2)
            * upright.camera_from_world,
        ..upright.clone()
    });
    let rolled = rig(rolled.collect());
    assert_eq!(
        search_sizes(&rolled).cameras[0].scale,
        search_sizes(&rig(upright)).cameras[0].scale
    );
}

#[test]
fn the_included_rigs_get_the_sizes_chosen_by_hand() {
    for name in ["pose2sim-balancing.toml", "pose2sim-balancing-shipped.toml"] {
        let got = shipped(name);
        assert_eq!(got.n_sharing, 4, "{name}");
        for it in &got.cameras {
            assert_eq!(it.frame_size, [272, 480], "{name} {it:?}");
        }
    }
    for name in ["humaneva-s1.toml", "umpm-triangle.toml"] {
        for it in &shipped(name).cameras {
            let px = it.person_in_frame_px().unwrap();
            assert!((GOOD_PX[0]..=GOOD_PX[1]).contains(&px), "{name} {it:?}");
        }
    }
}

#[test]
fn a_person_fills_about_half_of_the_picture_of_a_stereo_pair() {
    for (size, focal) in [
        ([640, 480], 550.0),
        ([1920, 1080], 1100.0),
        ([1080, 1920], 1600.0),
    ] {
        for toed_in in [0.0, 0.01, -0.01] {
            let cameras = [-1.0, 1.0].map(|side| {
                let turn = Isometry3::rotation(Vector3::y() * toed_in * side);
                let at = Isometry3::from_parts(
                    Translation3::new(-0.06 * side, 0.0, 0.0),
                    nalgebra::UnitQuaternion::identity(),
                );
                camera(if side < 0.0 { "l" } else { "r" }, size, focal, turn * at)
            });
            let up = UnitVector3::new_normalize(-Vector3::y());
            let rig = Rig::new(cameras.into(), Some(up), "planted").unwrap();
            for it in search_sizes(&rig).cameras {
                let share = it.person_px.unwrap() / f64::from(size[1]);
                assert!((0.35..0.75).contains(&share), "{it:?}");
                let px = it.person_in_frame_px().unwrap();
                assert!((110.0..=250.0).contains(&px), "{it:?}");
            }
        }
    }
}

#[test]
fn cameras_of_different_sizes_have_different_scales() {
    let mut cameras = ring(4, [1920, 1080], 1400.0, 3.5, 1.0);
    cameras[1] = camera("small", [640, 480], 500.0, cameras[1].camera_from_world);
    let rig = rig(cameras);
    let got = search_sizes(&rig);
    assert_eq!(
        got.cameras.iter().map(|camera| camera.scale).collect::<Vec<_>>(),
        [1.0 / 3.0, 0.75, 1.0 / 3.0, 1.0 / 3.0]
    );
    for px in in_the_middle(&rig) {
        assert!((GOOD_PX[0]..=GOOD_PX[1]).contains(&px), "{px}");
    }
}

#[test]
fn cameras_without_a_shared_space_get_the_largest_allowed_frame() {
    let outwards = [0.0, core::f64::consts::PI].map(|turn| {
        let at = looking_at_origin(0.0, 3.0, 0.0, 0.0);
        camera(
            if turn > 0.0 { "a" } else { "b" },
            [1920, 1080],
            1400.0,
            Isometry3::rotation(Vector3::y() * turn) * at,
        )
    });
    let got = search_sizes(&rig(outwards.into()));
    assert_eq!(got.n_sharing, 0);
    for it in got.cameras {
        assert_eq!((it.person_px, it.is_limited()), (None, false));
        let [width, height] = it.frame_size.map(u64::from);
        assert!(
            width * height <= MOST_PIXELS && 2 * width * height > MOST_PIXELS,
            "{width}x{height}"
        );
    }
}

#[test]
fn one_camera_that_looks_elsewhere_does_not_change_the_scale_of_the_others() {
    let mut cameras = ring(4, [1920, 1080], 1400.0, 3.5, 1.0);
    let alone = search_sizes(&rig(cameras.clone())).cameras[0].clone();
    let away = Isometry3::rotation(Vector3::y() * 2.8) * cameras[3].camera_from_world;
    cameras[3].camera_from_world = away;
    let got = search_sizes(&rig(cameras));
    assert_eq!(got.n_sharing, 3);
    assert_eq!(got.cameras[0].scale, alone.scale);
}

#[test]
fn people_far_from_large_cameras_are_reported_as_too_small() {
    let got = search_sizes(&rig(ring(4, [1920, 1080], 1400.0, 9.0, 2.0)));
    for it in got.cameras {
        assert!(it.is_limited(), "{it:?}");
        assert!(
            it.wanted > 2.0 * it.scale && it.person_in_frame_px().unwrap() < GOOD_PX[0],
            "{it:?}"
        );
    }
    // A small picture has a low cost, and is not enlarged.
    let got = search_sizes(&rig(ring(4, [640, 480], 350.0, 5.0, 2.0)));
    assert!(got.cameras.iter().all(|camera| camera.scale == 1.0 && !camera.is_limited()));
}

#[test]
fn a_camera_above_people_gets_the_same_size_of_parts_as_one_beside_them() {
    let mut cameras = ring(4, [1920, 1080], 1400.0, 3.5, 1.0);
    let down = Isometry3::rotation(Vector3::x() * core::f64::consts::PI)
        * Isometry3::translation(0.0, 0.0, -3.6);
    cameras.push(camera("above", [1920, 1080], 1400.0, down));
    let got = search_sizes(&rig(cameras));
    assert_eq!(got.n_sharing, 5);
    assert_eq!(got.cameras[4].scale, got.cameras[0].scale, "{got:?}");
}

#[test]
fn a_suggested_scale_is_round_and_gives_people_a_good_size() {
    assert_eq!(better_scale(&[[1.0, 690.0], [1.0, 710.0]]), Some(0.29));
    assert_eq!(better_scale(&[[0.25, 80.0]]), Some(0.63));
    assert_eq!(better_scale(&[[1.0, 20.0]]), Some(2.0));
    assert_eq!(better_scale(&[[0.1, 500.0]]), Some(0.042));
    assert_eq!(better_scale(&[]), None);
}
