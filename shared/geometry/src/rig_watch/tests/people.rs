//! People who walk about and gesture, as a detector finds them: whom the cameras then accuse.

use nalgebra::Rotation3;

use super::*;
use crate::{Framing, OutSize};

/// Points on either side; before them come head and neck.
const SIDE: usize = 12;
const N: usize = 2 + 2 * SIDE;
/// Of a side, the first so many are the arm.
const ARM: usize = 5;

fn mirror() -> Vec<usize> {
    let other = |it: usize| match it {
        0 | 1 => it,
        it if it < 2 + SIDE => it + SIDE,
        it => it - SIDE,
    };
    (0..N).map(other).collect()
}

/// A person who stands somewhere, turned, with arms raised by an angle.
fn person(at: Vector3<f64>, turn: f64, arms: [f64; 2]) -> Vec<Point3<f64>> {
    let mut points = vec![Vector3::new(0.0, 0.0, 0.7), Vector3::new(0.0, 0.0, 0.5)];
    for (side, raised) in [1.0, -1.0].into_iter().zip(arms) {
        let shoulder = Vector3::new(0.2 * side, 0.0, 0.45);
        let along = Vector3::new(side * raised.sin(), 0.3 * raised.sin(), -raised.cos());
        points.extend((0..ARM).map(|it| shoulder + along * (0.13 * it as f64)));
        points.extend((0..3).map(|it| Vector3::new(0.17 * side, 0.0, 0.3 - 0.15 * f64::from(it))));
        points
            .extend((0..4).map(|it| Vector3::new(0.12 * side, 0.03, -0.1 - 0.25 * f64::from(it))));
    }
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), turn);
    points
        .into_iter()
        .map(|it| Point3::from(turn * it + at))
        .collect()
}

/// What cameras find of a person who gestures, frame by frame.
struct Film {
    cameras: Vec<Camera>,
    chance: Box<dyn FnMut() -> f64>,
    /// Pixels by which a camera is always off, as its grid of cells has it.
    grid: Vec<[f64; 2]>,
    /// Where arms hang that are not found where they are: by view and side, for how many frames.
    lost: Vec<[u32; 2]>,
    frame: usize,
    gestures: bool,
}

impl Film {
    fn new(cameras: &[Camera], seed: u64, gestures: bool) -> Self {
        let mut chance = chance(seed);
        // The first numbers of neighbouring seeds are alike.
        (0..20).for_each(|_| {
            chance();
        });
        Self {
            grid: cameras
                .iter()
                .map(|_| [2.0 * chance(), 2.0 * chance()])
                .collect(),
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
        let is = person(at, turn, [raised, 0.8 * raised]);
        let hangs = person(at, turn, [0.1; 2]);
        (0..self.cameras.len())
            .map(|view| Some(self.find(view, &is, &hangs)))
            .collect()
    }

    /// One view: noise, arms that are lost for a while, left for right now and then, somebody else at times.
    fn find(&mut self, view: usize, is: &[Point3<f64>], hangs: &[Point3<f64>]) -> Vec<[f64; 2]> {
        let mut points = is.to_vec();
        for side in 0..2 {
            let arm = 2 + side * SIDE..2 + side * SIDE + ARM;
            if self.lost[view][side] == 0 && (self.chance)() > 0.9 {
                self.lost[view][side] = 15;
            }
            if self.lost[view][side] > 0 {
                self.lost[view][side] -= 1;
                points[arm.clone()].copy_from_slice(&hangs[arm]);
            }
        }
        let is_turned = (self.chance)() > 0.8;
        let is_elsewhere = (self.chance)() > 0.94;
        let shift = if is_elsewhere { 80.0 } else { 0.0 };
        let mirror = mirror();
        let camera = self.cameras[view].clone();
        let mut found = Vec::new();
        for nth in 0..N {
            let point = points[if is_turned { mirror[nth] } else { nth }];
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

/// Whom a watch names after some frames.
fn named(real: &[Camera], believed: Vec<Camera>, seed: u64, n_frames: usize) -> Vec<usize> {
    let mut film = Film::new(real, seed, true);
    let mut watch = RigWatch::new(believed);
    (0..n_frames).for_each(|_| watch.note(&film.next()));
    (0..real.len()).filter(|it| watch.is_named(*it)).collect()
}

#[test]
fn nobody_is_named_where_people_gesture_and_no_camera_was_moved() {
    for seed in 0..20 {
        for n in [3, 4, 5] {
            let cameras = around(n);
            let named = named(&cameras, cameras.clone(), seed, 90);
            assert_eq!(named, NOBODY, "seed {seed}, {n} cameras");
        }
    }
}

#[test]
fn a_camera_turned_by_two_degrees_is_named_and_no_other_where_people_gesture() {
    let mut wrong = Vec::new();
    for seed in 0..20_u64 {
        for n in [4, 5, 6] {
            let cameras = around(n);
            let victim = seed as usize % n;
            let bearing = 0.31 * seed as f64;
            let axis = Vector3::new(bearing.cos(), bearing.sin(), 0.0);
            let mut believed = cameras.clone();
            believed[victim] = turned(&cameras[victim], axis, 2.0);
            let named = named(&cameras, believed, seed, 90);
            if named != [victim] {
                wrong.push(format!("seed {seed}: {victim} of {n}, named {named:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn twenty_frames_are_enough_to_name_a_camera() {
    let cameras = around(4);
    let mut believed = cameras.clone();
    believed[2] = turned(&cameras[2], Vector3::y(), 3.0);
    let mut film = Film::new(&cameras, 4, false);
    let mut watch = RigWatch::new(believed);
    (0..20).for_each(|_| watch.note(&film.next()));
    assert!(watch.is_named(2));
    // Frames that tell nothing do not count.
    let mut watch = RigWatch::new(cameras.clone());
    (0..100).for_each(|_| watch.note(&vec![None; 4]));
    assert!((0..4).all(|it| !watch.is_named(it)));
}

fn framed(cameras: &[Camera]) -> Vec<Framing> {
    let framing = |(nth, it): (usize, &Camera)| {
        let size = it.intrinsics.size;
        Framing::new(it, size, None, OutSize::Scale(0.5), 0.2 * nth as f64).unwrap()
    };
    cameras.iter().enumerate().map(framing).collect()
}

/// What is found if the footage of view `i` is that of camera `footage[i]`.
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
            Some(points.iter().map(|it| frame(*it)).collect())
        };
        let points: Vec<_> = footage.iter().enumerate().map(of_view).collect();
        watch.note(&points);
    }
    watch
}

/// Rigs of rooms: a ring, half a ring, and cameras at odd places.
fn rigs() -> Vec<Vec<Camera>> {
    let mut odd = around(4);
    for (nth, camera) in odd.iter_mut().enumerate() {
        let bearing = [0.0, 0.7, 2.0, 4.4][nth];
        camera.camera_from_world =
            looking_at_origin(bearing, 4.0 + 0.4 * nth as f64, 1.0 + 0.5 * nth as f64, 0.1);
    }
    vec![
        around(3),
        around(4),
        around(6),
        ring(4, LensModel::Pinhole),
        odd,
    ]
}

#[test]
fn footage_of_two_cameras_that_was_exchanged_is_named() {
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
            // Three in a ring look alike whichever two are exchanged: that something is can be said.
            let is_right = found.is_some_and(|it| it.views == [a.min(b), a.max(b)] && it.is_sure);
            let is_said = rig == 0 && found.is_some_and(|it| !it.is_sure);
            if !is_right && !is_said {
                wrong.push(format!(
                    "rig {rig}, seed {seed}: {a} and {b}, found {:?}",
                    watch.best()
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn where_nothing_was_exchanged_nobody_is_named() {
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
fn footage_of_three_cameras_passed_round_is_not_taken_for_that_of_its_cameras() {
    // In a ring it would look like footage of two that was exchanged, seen from the other side.
    let cameras = rigs().pop().expect("cameras at odd places");
    for seed in 0..8 {
        let watch = watched(&cameras, &[1, 2, 0, 3], seed, seed % 2 == 0);
        let said = watch.contradiction();
        assert!(
            said.is_some() || watch.swap().is_some(),
            "seed {seed}: {:?}",
            watch.best()
        );
    }
}

#[test]
fn a_camera_that_was_moved_is_not_called_exchanged() {
    for seed in 0..20_u64 {
        let cameras = around(4);
        let mut film = Film::new(&cameras, seed, true);
        let victim = seed as usize % 4;
        let mut believed = cameras.clone();
        let turn = UnitQuaternion::new(Vector3::y() * (0.02 + 0.01 * seed as f64));
        believed[victim].camera_from_world = turn * believed[victim].camera_from_world;
        let plain =
            |it: &Camera| Framing::new(it, it.intrinsics.size, None, OutSize::Scale(1.0), 0.0);
        let framings = believed.iter().map(|it| plain(it).unwrap());
        let mut watch = SwapWatch::new(framings.collect(), Some(mirror()));
        (0..40).for_each(|_| watch.note(&film.next()));
        assert_eq!(watch.swap(), None, "seed {seed}");
    }
}
