//! Rigs that are right, and rigs one camera of which was moved after the calibration.

mod people;

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;
use crate::LensModel;
use crate::testing::{looking_at_origin, ring};

/// Numbers in -1..1 that follow from a seed.
fn chance(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Cameras in equal distances around the origin, which look down at it from different heights.
fn around(n: usize) -> Vec<Camera> {
    let cameras = ring(n, LensModel::Pinhole).into_iter().enumerate();
    let place = |(nth, camera): (usize, Camera)| Camera {
        camera_from_world: looking_at_origin(
            core::f64::consts::TAU * nth as f64 / n as f64,
            4.5,
            1.0 + 0.2 * (nth % 3) as f64,
            0.0,
        ),
        ..camera
    };
    cameras.map(place).collect()
}

fn turned(camera: &Camera, axis: Vector3<f64>, degrees: f64) -> Camera {
    let turn = UnitQuaternion::new(axis * degrees.to_radians());
    Camera {
        camera_from_world: turn * camera.camera_from_world,
        ..camera.clone()
    }
}

/// Watches a person of 20 points who walks about, seen with errors: of `noise_px` at most, and every
/// eighth point somewhere else.
fn watch(
    real: &[Camera],
    believed: Vec<Camera>,
    noise_px: f64,
    seed: u64,
    n_frames: usize,
) -> RigWatch {
    let mut chance = chance(seed);
    let mut watch = RigWatch::new(believed);
    for _ in 0..n_frames {
        let at = Vector3::new(chance(), chance(), 0.0) * 0.8;
        let points: Vec<Point3<f64>> = (0..20)
            .map(|_| {
                Point3::from(at + Vector3::new(0.4 * chance(), 0.4 * chance(), 0.9 * chance()))
            })
            .collect();
        let see = |camera: &Camera| {
            let point = |(nth, it): (usize, &Point3<f64>)| {
                let seen = camera.project(it).unwrap();
                let far = if nth % 8 == 0 { 60.0 } else { noise_px };
                [seen.x + far * chance(), seen.y + far * chance()]
            };
            Some(points.iter().enumerate().map(point).collect())
        };
        let seen: Vec<Option<Vec<[f64; 2]>>> = real.iter().map(see).collect();
        watch.note(&seen);
    }
    watch
}

/// No camera.
const NOBODY: [usize; 0] = [];

fn suspected(watch: &RigWatch) -> Vec<usize> {
    watch.suspects().iter().map(|it| it.view).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_right_rig_is_not_accused(n in 2_usize..8, noise_px in 0.0..12.0, seed: u64) {
        let cameras = around(n);
        let watch = watch(&cameras, cameras.clone(), noise_px, seed, 30);
        prop_assert_eq!(suspected(&watch), NOBODY);
    }

    #[test]
    fn a_camera_that_is_two_degrees_off_is_named_and_no_other(
        n in 4_usize..8, noise_px in 0.0..6.0, seed: u64, victim in any::<prop::sample::Index>(), bearing in 0.0..6.2,
    ) {
        let cameras = around(n);
        let victim = victim.index(n);
        let mut believed = cameras.clone();
        // Up, down, left or right: a turn about its own axis hardly moves what is in the middle.
        believed[victim] = turned(&cameras[victim], Vector3::new(f64::cos(bearing), f64::sin(bearing), 0.0), 2.0);
        let watch = watch(&cameras, believed, noise_px, seed, 30);
        prop_assert_eq!(suspected(&watch), [victim], "{:?}", watch.suspects());
        let [it] = watch.suspects()[..] else { unreachable!() };
        prop_assert!(it.residual_px > 2.5 * it.without_px, "{it:?}");
        prop_assert_eq!(Some(it.residual_px), watch.residual_px(victim));
    }
}

#[test]
fn of_three_cameras_one_that_is_tilted_is_named() {
    let cameras = around(3);
    let mut believed = cameras.clone();
    believed[1] = turned(&cameras[1], Vector3::x(), 2.0);
    let watch = watch(&cameras, believed, 2.0, 5, 30);
    assert_eq!(suspected(&watch), [1]);
}

#[test]
fn what_is_off_by_half_a_cell_is_not_called_moved() {
    let cameras = around(4);
    let mut believed = cameras.clone();
    // Two pixels, all of them in one direction.
    believed[1].intrinsics.cx += 2.0;
    let watch = watch(&cameras, believed, 0.0, 5, 30);
    assert!(watch.residual_px(1) > watch.without_px(1).map(|it| FACTOR * it));
    assert_eq!(suspected(&watch), NOBODY);
}

#[test]
fn of_two_cameras_nobody_can_be_named() {
    let cameras = around(2);
    let believed = vec![cameras[0].clone(), turned(&cameras[1], Vector3::x(), 5.0)];
    let watch = watch(&cameras, believed, 0.0, 1, 30);
    assert_eq!(suspected(&watch), NOBODY);
    assert_eq!(watch.residual_px(0), None);
}

#[test]
fn nothing_is_said_before_enough_was_seen() {
    let cameras = around(4);
    let mut believed = cameras.clone();
    believed[2] = turned(&cameras[2], Vector3::y(), 5.0);
    let mut early = watch(&cameras, believed, 0.0, 1, LEAST_FRAMES - 1);
    assert_eq!((early.residual_px(2), suspected(&early)), (None, vec![]));
    // What sees nobody, or too little, or nothing at all, says nothing.
    early.note(&vec![None; 4]);
    early.note(&vec![Some(vec![[300.0, 200.0]; LEAST_POINTS - 1]); 4]);
    early.note(&vec![Some(vec![[f64::NAN; 2]; 20]); 4]);
    early.note(&[]);
    assert_eq!(early.residual_px(2), None);
}

#[test]
fn a_camera_that_is_put_right_is_forgiven() {
    let cameras = around(4);
    let mut believed = cameras.clone();
    believed[3] = turned(&cameras[3], Vector3::y(), 3.0);
    let mut it = watch(&cameras, believed.clone(), 1.0, 2, WINDOW);
    assert_eq!(suspected(&it), [3]);
    // As somebody does who turns the camera itself back to where the calibration says.
    let right = watch(&believed, believed.clone(), 1.0, 3, WINDOW);
    let groups = it.groups.iter_mut().zip(&right.groups);
    for (group, right) in groups {
        for px in &right.px {
            group.note(&[*px; LEAST_POINTS]);
        }
    }
    assert_eq!(suspected(&it), NOBODY);
}
