//! Tests with detections of a person who walks and gestures, and the cameras that are reported.

use nalgebra::Rotation3;

use super::*;
use crate::{Framing, OutSize};

/// Number of points on each side of the body. The points of the head and the neck come before those of both sides.
const SIDE: usize = 12;
const N: usize = 2 + 2 * SIDE;
/// Number of points of an arm. They are the first points of a side.
const ARM: usize = 5;

fn mirror() -> Vec<usize> {
    let other = |point: usize| match point {
        0 | 1 => point,
        left if left < 2 + SIDE => left + SIDE,
        right => right - SIDE,
    };
    (0..N).map(other).collect()
}

/// Returns the points of a person at a position, rotated about the vertical, with arms raised by an angle.
fn person(at: Vector3<f64>, turn: f64, arms: [f64; 2]) -> Vec<Point3<f64>> {
    let mut points = vec![Vector3::new(0.0, 0.0, 0.7), Vector3::new(0.0, 0.0, 0.5)];
    for (side, raised) in [1.0, -1.0].into_iter().zip(arms) {
        let shoulder = Vector3::new(0.2 * side, 0.0, 0.45);
        let along = Vector3::new(side * raised.sin(), 0.3 * raised.sin(), -raised.cos());
        points.extend((0..ARM).map(|nth| shoulder + along * (0.13 * nth as f64)));
        points
            .extend((0..3).map(|nth| Vector3::new(0.17 * side, 0.0, 0.3 - 0.15 * f64::from(nth))));
        points.extend(
            (0..4).map(|nth| Vector3::new(0.12 * side, 0.03, -0.1 - 0.25 * f64::from(nth))),
        );
    }
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
    points.into_iter().map(|point| Point3::from(turn * point + at)).collect()
}

/// Detections of a person by several cameras, frame by frame.
struct Film {
    cameras: Vec<Camera>,
    chance: Box<dyn FnMut() -> f64>,
    /// Constant offset of a camera, as from the grid of its feature cells, in pixels.
    grid: Vec<[f64; 2]>,
    /// Remaining number of frames in which an arm is wrongly detected as hanging, by view and side.
    lost: Vec<[u32; 2]>,
    frame: usize,
    gestures: bool,
}

impl Film {
    fn new(cameras: &[Camera], seed: u64, gestures: bool) -> Self {
        let mut chance = chance(seed);
        // The first numbers are skipped, because those of neighbouring seeds are similar.
        (0..20).for_each(|_| {
            chance();
        });
        Self {
            grid: cameras.iter().map(|_| [2.0 * chance(), 2.0 * chance()]).collect(),
            lost: vec![[0; 2]; cameras.len()],
            cameras: cameras.to_vec(),
            chance: Box::new(chance),
            frame: 0,
            gestures,
        }
    }

    fn next(&mut self) -> Vec<Option<Vec<[f64; 2]>>> {
        let time = self.frame as f64 / 15.0;
        self.frame += 1;
        let at = Vector3::new(0.6 * (0.7 * time).sin(), 0.5 * (0.5 * time).cos(), 0.0);
        let raised = if self.gestures {
            1.3 + 1.2 * (3.0 * time).sin()
        } else {
            0.1
        };
        let turn = 0.8 * time;
        let actual = person(at, turn, [raised, 0.8 * raised]);
        let hanging = person(at, turn, [0.1; 2]);
        (0..self.cameras.len())
            .map(|view| Some(self.detect(view, &actual, &hanging)))
            .collect()
    }

    /// Detects the person in one view, with noise. Arms are lost for some frames; sometimes left and right are swapped, or the person is
    /// shifted.
    fn detect(
        &mut self,
        view: usize,
        actual: &[Point3<f64>],
        hanging: &[Point3<f64>],
    ) -> Vec<[f64; 2]> {
        let mut points = actual.to_vec();
        for side in 0..2 {
            let arm = 2 + side * SIDE..2 + side * SIDE + ARM;
            if self.lost[view][side] == 0 && (self.chance)() > 0.9 {
                self.lost[view][side] = 15;
            }
            if self.lost[view][side] > 0 {
                self.lost[view][side] -= 1;
                points[arm.clone()].copy_from_slice(&hanging[arm]);
            }
        }
        let is_mirrored = (self.chance)() > 0.8;
        let is_shifted = (self.chance)() > 0.94;
        let shift = if is_shifted { 80.0 } else { 0.0 };
        let mirror = mirror();
        let camera = self.cameras[view].clone();
        let mut found = Vec::new();
        for nth in 0..N {
            let point = points[if is_mirrored { mirror[nth] } else { nth }];
            let px = camera.project(&point).unwrap();
            let grid = self.grid[view];
            let off = |axis: usize, chance: f64| grid[axis] + 4.0 * chance + shift;
            found.push([
                px.x + off(0, (self.chance)()),
                px.y + off(1, (self.chance)()),
            ]);
        }
        found
    }
}

/// Returns the cameras that a watch reports after some frames.
fn reported(real: &[Camera], believed: Vec<Camera>, seed: u64, n_frames: usize) -> Vec<usize> {
    let mut film = Film::new(real, seed, true);
    let mut watch = RigWatch::new(believed);
    (0..n_frames).for_each(|_| watch.note(&film.next()));
    (0..real.len()).filter(|view| watch.is_reported(*view)).collect()
}

#[test]
fn no_camera_is_reported_if_people_gesture_and_no_camera_moved() {
    for seed in 0..20 {
        for n in [3, 4, 5] {
            let cameras = around(n);
            let reported = reported(&cameras, cameras.clone(), seed, 90);
            assert_eq!(reported, NO_CAMERA, "seed {seed}, {n} cameras");
        }
    }
}

#[test]
fn only_a_camera_rotated_by_two_degrees_is_reported_if_people_gesture() {
    let mut wrong = Vec::new();
    for seed in 0..20_u64 {
        for n in [4, 5, 6] {
            let cameras = around(n);
            let moved = seed as usize % n;
            let bearing = 0.31 * seed as f64;
            let axis = Vector3::new(bearing.cos(), bearing.sin(), 0.0);
            let mut believed = cameras.clone();
            believed[moved] = turned(&cameras[moved], axis, 2.0);
            let reported = reported(&cameras, believed, seed, 90);
            if reported != [moved] {
                wrong.push(format!(
                    "seed {seed}: {moved} of {n}, reported {reported:?}"
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn twenty_frames_are_enough_to_report_a_camera() {
    let cameras = around(4);
    let mut believed = cameras.clone();
    believed[2] = turned(&cameras[2], Vector3::y(), 3.0);
    let mut film = Film::new(&cameras, 4, false);
    let mut watch = RigWatch::new(believed);
    (0..20).for_each(|_| watch.note(&film.next()));
    assert!(watch.is_reported(2));
    // Frames without detections do not count.
    let mut watch = RigWatch::new(cameras.clone());
    (0..100).for_each(|_| watch.note(&vec![None; 4]));
    assert!((0..4).all(|view| !watch.is_reported(view)));
}

fn framed(cameras: &[Camera]) -> Vec<Framing> {
    let framing = |(nth, camera): (usize, &Camera)| {
        let size = camera.intrinsics.size;
        Framing::new(camera, size, None, OutSize::Scale(0.5), 0.2 * nth as f64).unwrap()
    };
    cameras.iter().enumerate().map(framing).collect()
}

/// Returns a watch in which view `i` shows the footage of camera `footage[i]`.
fn watched(cameras: &[Camera], footage: &[usize], seed: u64, gestures: bool) -> SwapWatch {
    let mut film = Film::new(cameras, seed, gestures);
    let framings = framed(cameras);
    let mut watch = SwapWatch::new(framings.clone(), Some(mirror()));
    for _ in 0..20 {
        let found = film.next();
        let of_view = |(view, &of): (usize, &usize)| {
            let [[a, b, e], [c, d, f]] = framings[view].source_from_output();
            let determinant = a * d - b * c;
            let frame = |[x, y]: [f64; 2]| {
                let [x, y] = [x - e, y - f];
                [(d * x - b * y) / determinant, (a * y - c * x) / determinant]
            };
            let points = found[of].as_ref()?;
            Some(points.iter().map(|px| frame(*px)).collect())
        };
        let points: Vec<_> = footage.iter().enumerate().map(of_view).collect();
        watch.note(&points);
    }
    watch
}

/// Returns rigs: full rings, a partial ring, and cameras at irregular positions.
fn rigs() -> Vec<Vec<Camera>> {
    let mut irregular = around(4);
    for (nth, camera) in irregular.iter_mut().enumerate() {
        let bearing = [0.0, 0.7, 2.0, 4.4][nth];
        camera.camera_from_world =
            looking_at_origin(bearing, 4.0 + 0.4 * nth as f64, 1.0 + 0.5 * nth as f64, 0.1);
    }
    vec![
        around(3),
        around(4),
        around(6),
        ring(4, LensModel::Pinhole),
        irregular,
    ]
}

#[test]
fn swapped_footage_of_two_cameras_is_detected() {
    let mut wrong = Vec::new();
    for (rig, cameras) in rigs().into_iter().enumerate() {
        let n = cameras.len();
        for seed in 0..8_u64 {
            let a = seed as usize % n;
            let b = (a + 1 + seed as usize % (n - 1)) % n;
            let mut footage: Vec<usize> = (0..n).collect();
            footage.swap(a, b);
            let watch = watched(&cameras, &footage, seed, seed % 2 == 0);
            let found = watch.swap();
            // In a ring of three, it can be detected that two cameras are swapped, but not which ones.
            let is_right =
                found.is_some_and(|swap| swap.views == [a.min(b), a.max(b)] && swap.is_sure);
            let is_unsure = rig == 0 && found.is_some_and(|swap| !swap.is_sure);
            if !is_right && !is_unsure {
                wrong.push(format!(
                    "rig {rig}, seed {seed}: {a} and {b}, found {:?}",
                    watch.best(12)
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn no_swap_is_reported_for_unswapped_footage() {
    let two = ring(2, LensModel::Pinhole);
    for (rig, cameras) in rigs().into_iter().chain([two]).enumerate() {
        let n = cameras.len();
        let footage: Vec<usize> = (0..n).collect();
        for seed in 0..20_u64 {
            let watch = watched(&cameras, &footage, seed, seed % 2 == 0);
            assert_eq!(watch.swap(), None, "rig {rig}, seed {seed}");
            assert_eq!(watch.contradiction(), None, "rig {rig}, seed {seed}");
        }
    }
}

#[test]
fn cyclically_swapped_footage_of_three_cameras_is_detected() {
    // In a ring, this would look like two swapped cameras.
    let cameras = rigs().pop().expect("cameras at irregular places");
    for seed in 0..8 {
        let watch = watched(&cameras, &[1, 2, 0, 3], seed, seed % 2 == 0);
        let contradiction = watch.contradiction();
        assert!(
            contradiction.is_some() || watch.swap().is_some(),
            "seed {seed}: {:?}",
            watch.best(12)
        );
    }
}

#[test]
fn a_moved_camera_is_not_reported_as_swapped() {
    for seed in 0..20_u64 {
        let cameras = around(4);
        let mut film = Film::new(&cameras, seed, true);
        let moved = seed as usize % 4;
        let mut believed = cameras.clone();
        let turn = UnitQuaternion::new(Vector3::y() * (0.02 + 0.01 * seed as f64));
        believed[moved].camera_from_world = turn * believed[moved].camera_from_world;
        let plain = |camera: &Camera| {
            Framing::new(
                camera,
                camera.intrinsics.size,
                None,
                OutSize::Scale(1.0),
                0.0,
            )
        };
        let framings = believed.iter().map(|camera| plain(camera).unwrap());
        let mut watch = SwapWatch::new(framings.collect(), Some(mirror()));
        (0..40).for_each(|_| watch.note(&film.next()));
        assert_eq!(watch.swap(), None, "seed {seed}");
    }
}
