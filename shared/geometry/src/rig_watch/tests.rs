//! Tests with correct rigs, and with one camera moved after the calibration.

mod people;

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;
use crate::LensModel;
use crate::testing::{looking_at_origin, ring};

/// Returns a generator of pseudo-random numbers in -1..1.
fn chance(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Returns cameras at equal angles around the origin, looking down at it from different heights.
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

/// Returns a watch after frames of 20 points of a walking person. Errors are at most `noise_px`, and 60 px in every eighth point.
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
        let observe = |camera: &Camera| {
            let point = |(nth, point): (usize, &Point3<f64>)| {
                let pixel = camera.project(point).unwrap();
                let noise = if nth % 8 == 0 { 60.0 } else { noise_px };
                [pixel.x + noise * chance(), pixel.y + noise * chance()]
            };
            Some(points.iter().enumerate().map(point).collect())
        };
        let observed: Vec<Option<Vec<[f64; 2]>>> = real.iter().map(observe).collect();
        watch.note(&observed);
    }
    watch
}

const NO_CAMERA: [usize; 0] = [];

fn suspected(watch: &RigWatch) -> Vec<usize> {
    watch.suspects().iter().map(|suspect| suspect.view).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn no_camera_of_a_correct_rig_is_suspected(n in 2_usize..8, noise_px in 0.0..12.0, seed: u64) {
        let cameras = around(n);
        let watch = watch(&cameras, cameras.clone(), noise_px, seed, 30);
        prop_assert_eq!(suspected(&watch), NO_CAMERA);
    }

    #[test]
    fn only_the_camera_that_is_rotated_by_two_degrees_is_suspected(
        n in 4_usize..8, noise_px in 0.0..6.0, seed: u64, moved in any::<prop::sample::Index>(), bearing in 0.0..6.2,
    ) {
        let cameras = around(n);
        let moved = moved.index(n);
        let mut believed = cameras.clone();
        // The rotation is not about the optical axis, which would hardly move points in the middle of the image.
        believed[moved] = turned(&cameras[moved], Vector3::new(f64::cos(bearing), f64::sin(bearing), 0.0), 2.0);
        let watch = watch(&cameras, believed, noise_px, seed, 30);
        prop_assert_eq!(suspected(&watch), [moved], "{:?}", watch.suspects());
        let [suspect] = watch.suspects()[..] else { unreachable!() };
        prop_assert!(suspect.residual_px > 2.5 * suspect.without_px, "{suspect:?}");
        prop_assert_eq!(Some(suspect.residual_px), watch.residual_px(moved));
    }
}

#[test]
fn one_tilted_camera_of_three_is_suspected() {
    let cameras = around(3);
    let mut believed = cameras.clone();
    believed[1] = turned(&cameras[1], Vector3::x(), 2.0);
    let watch = watch(&cameras, believed, 2.0, 5, 30);
    assert_eq!(suspected(&watch), [1]);
}

#[test]
fn an_offset_of_half_a_grid_cell_is_not_reported_as_a_moved_camera() {
    let cameras = around(4);
    let mut believed = cameras.clone();
    // The believed principal point is wrong by two pixels.
    believed[1].intrinsics.cx += 2.0;
    let watch = watch(&cameras, believed, 0.0, 5, 30);
    assert!(watch.residual_px(1) > watch.without_px(1).map(|px| FACTOR * px));
    assert_eq!(suspected(&watch), NO_CAMERA);
}

#[test]
fn with_two_cameras_none_is_suspected() {
    let cameras = around(2);
    let believed = vec![cameras[0].clone(), turned(&cameras[1], Vector3::x(), 5.0)];
    let watch = watch(&cameras, believed, 0.0, 1, 30);
    assert_eq!(suspected(&watch), NO_CAMERA);
    assert_eq!(watch.residual_px(0), None);
}

#[test]
fn there_is_no_result_before_enough_frames() {
    let cameras = around(4);
    let mut believed = cameras.clone();
    believed[2] = turned(&cameras[2], Vector3::y(), 5.0);
    let mut early = watch(&cameras, believed, 0.0, 1, MIN_FRAMES - 1);
    assert_eq!((early.residual_px(2), suspected(&early)), (None, vec![]));
    // Frames without a person, with too few points, or without finite points do not count.
    early.note(&vec![None; 4]);
    early.note(&vec![Some(vec![[300.0, 200.0]; MIN_POINTS - 1]); 4]);
    early.note(&vec![Some(vec![[f64::NAN; 2]; 20]); 4]);
    early.note(&[]);
    assert_eq!(early.residual_px(2), None);
}

#[test]
fn a_camera_that_is_moved_back_is_no_longer_suspected() {
    let cameras = around(4);
    let mut believed = cameras.clone();
    believed[3] = turned(&cameras[3], Vector3::y(), 3.0);
    let mut first = watch(&cameras, believed.clone(), 1.0, 2, WINDOW);
    assert_eq!(suspected(&first), [3]);
    // The real camera is moved back to its calibrated pose.
    let right = watch(&believed, believed.clone(), 1.0, 3, WINDOW);
    let groups = first.groups.iter_mut().zip(&right.groups);
    for (group, right) in groups {
        for offset in &right.offsets_px {
            group.note(&[*offset; MIN_POINTS]);
        }
    }
    assert_eq!(suspected(&first), NO_CAMERA);
}
