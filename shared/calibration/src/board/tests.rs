//! Tests with simulated boards and known cameras.

use geometry::{Lens, LensModel};
use nalgebra::{Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::*;

const SIZE: [u32; 2] = [1280, 720];

fn board(columns: usize, rows: usize) -> Vec<Point2<f64>> {
    let place = |nth: usize| {
        let at = [nth % columns, nth / columns];
        Point2::new(at[0] as f64 * 0.05, at[1] as f64 * 0.05)
    };
    (0..columns * rows).map(place).collect()
}

fn looking(name: &str, from: Point3<f64>, focal: f64, lens: LensModel) -> Camera {
    let to = Point3::new(0.0, 0.0, 1.5);
    let rotation = UnitQuaternion::look_at_rh(&(to - from), &Vector3::y());
    let flip = Rotation3::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI);
    let rotation = UnitQuaternion::from_rotation_matrix(&flip) * rotation;
    Camera {
        name: name.to_owned(),
        intrinsics: Intrinsics {
            fx: focal,
            fy: focal * 1.004,
            cx: 651.0,
            cy: 352.0,
            size: SIZE,
            lens: Lens::new(lens),
        },
        camera_from_world: Isometry3::from_parts(
            Translation3::from(rotation * -from.coords),
            rotation,
        ),
    }
}

const BROWN: LensModel = LensModel::BrownConrady {
    k: [-0.3, 0.09, 0.01, 0.0, 0.0, 0.0],
    p: [0.001, -0.0006],
};

fn ring(n: usize, lens: LensModel) -> Vec<Camera> {
    let each = (0..n).map(|nth| {
        let angle = nth as f64 * 2.0 * core::f64::consts::PI / n as f64;
        let from = Point3::new(1.4 * angle.sin(), -0.5, 1.5 - 1.4 * angle.cos());
        looking(&format!("cam{nth}"), from, 700.0 + 60.0 * nth as f64, lens)
    });
    each.collect()
}

struct Show<'a> {
    cameras: &'a [Camera],
    board: &'a [Point2<f64>],
    n_frames: usize,
    noise_px: f64,
}

/// Returns the sight of a board by a camera in a frame, from either side if the board is visible from both.
fn seen(
    (nth, camera): (usize, &Camera),
    (board, pose): (&[Point2<f64>], &Isometry3<f64>),
    (frame, has_two_sides): (usize, bool),
    noise: &mut dyn FnMut() -> f64,
) -> Option<Sight> {
    let facing = (camera.camera_from_world.rotation * pose.rotation * Vector3::z()).z;
    let facing = if has_two_sides { facing.abs() } else { facing };
    if facing < 0.35 {
        return None;
    }
    let points = board.iter().enumerate().filter_map(|(id, point)| {
        let image = camera.project(&(pose * Point3::new(point.x, point.y, 0.0)))?;
        let inside = (0..2).all(|i| image[i] > 0.0 && image[i] < f64::from(SIZE[i]));
        inside.then(|| (id, image + Vector2::new(noise(), noise())))
    });
    let sight = Sight::new(nth, frame, points, board);
    (sight.points.len() >= LEAST_CORNERS).then_some(sight)
}

/// Returns a random pose in view of the cameras.
fn somewhere(random: &mut fastrand::Rng) -> Isometry3<f64> {
    let mut spread = |reach: f64| reach * (2.0 * random.f64() - 1.0);
    let turn = Vector3::new(spread(0.6), spread(3.1), spread(0.6));
    let place = Translation3::new(spread(0.45), spread(0.3), 1.5 + spread(0.45));
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::y() * turn.y)
        * UnitQuaternion::from_scaled_axis(Vector3::new(turn.x, 0.0, turn.z));
    Isometry3::from_parts(place, rotation)
}

fn noisy(random: &mut fastrand::Rng, noise_px: f64) -> f64 {
    let sum: f64 = (0..12).map(|_| random.f64()).sum();
    noise_px * (sum - 6.0)
}

impl Show<'_> {
    /// Returns sights of a moving board, if at least `LEAST_CORNERS` corners of its front are in a picture.
    fn sights(&self, random: &mut fastrand::Rng) -> Vec<Sight> {
        let mut sights = Vec::new();
        for frame in 0..self.n_frames {
            let pose = somewhere(random);
            for camera in self.cameras.iter().enumerate() {
                let noise = &mut || noisy(random, self.noise_px);
                sights.extend(seen(camera, (self.board, &pose), (frame, false), noise));
            }
        }
        sights
    }
}

fn task(cameras: &[Camera], board: &[Point2<f64>], sights: Vec<Sight>) -> Task {
    Task {
        names: cameras.iter().map(|camera| camera.name.clone()).collect(),
        sizes: vec![SIZE; cameras.len()],
        known: vec![None; cameras.len()],
        lens: LensKind::Five,
        board: board.to_vec(),
        look_alikes: Vec::new(),
        sights,
        wants_rig: true,
        most_frames: 60,
    }
}

/// Returns the largest errors: focal lengths as a fraction, rotations in degrees, and distances from the first camera as a fraction.
fn errors(outcome: &Outcome, truth: &[Camera]) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    let first = &truth[0].camera_from_world;
    for (found, truth) in outcome.cameras.iter().zip(truth) {
        let focal = found.camera.intrinsics.fx / truth.intrinsics.fx - 1.0;
        worst[0] = worst[0].max(focal.abs());
        let expected = truth.camera_from_world * first.inverse();
        let pose = found.camera.camera_from_world;
        let turn = pose.rotation.angle_to(&expected.rotation).to_degrees();
        worst[1] = worst[1].max(turn);
        let length = expected.translation.vector.norm();
        let off = (pose.translation.vector - expected.translation.vector).norm();
        worst[2] = worst[2].max(off / length.max(1.0));
    }
    worst
}

#[test]
fn a_rig_is_found_even_if_opposite_cameras_never_see_the_board_together() {
    let truth = ring(5, BROWN);
    let board = board(6, 4);
    let show = Show {
        cameras: &truth,
        board: &board,
        n_frames: 120,
        noise_px: 0.2,
    };
    let mut random = fastrand::Rng::with_seed(3);
    let mut sights = show.sights(&mut random);
    // One corner in a hundred is displaced.
    let mut n_wrong = 0;
    for sight in &mut sights {
        for (_, at) in &mut sight.points {
            if random.f64() < 0.01 {
                *at += Vector2::new(12.0, -9.0);
                n_wrong += 1;
            }
        }
    }
    let outcome = calibrate(&task(&truth, &board, sights)).unwrap();
    let [focal, turn, place] = errors(&outcome, &truth);
    assert!(
        focal < 4e-3 && turn < 0.6 && place < 1e-2,
        "{focal} {turn} {place}"
    );
    assert_eq!(outcome.doubts, []);
    let all = outcome.cameras.iter().flat_map(|camera| &camera.residuals);
    let left_out = all.clone().filter(|residual| residual.is_wrong).count();
    assert!(
        left_out > 0 && left_out <= n_wrong,
        "{left_out} of {n_wrong}"
    );
    assert!(
        (0.15..0.25).contains(&outcome.sigma_px),
        "{}",
        outcome.sigma_px
    );
    // The stated standard deviations of the focal lengths are correct.
    for (found, truth) in outcome.cameras.iter().zip(&truth) {
        let focal = found.numbers.iter().find(|number| number.name == "focal length");
        let off = (found.camera.intrinsics.fx - truth.intrinsics.fx).abs();
        assert!(
            focal.is_some_and(|focal| off < 4.0 * focal.sd),
            "{off} {focal:?}"
        );
    }
}

#[test]
fn a_fisheye_lens_is_calibrated() {
    let lens = LensModel::KannalaBrandt {
        k: [0.02, -0.01, 0.003, 0.0],
    };
    let mut truth = ring(2, lens);
    for camera in &mut truth {
        camera.intrinsics.fx = 420.0;
        camera.intrinsics.fy = 421.0;
    }
    let board = board(6, 4);
    let show = Show {
        cameras: &truth[..1],
        board: &board,
        n_frames: 60,
        noise_px: 0.2,
    };
    let sights = show.sights(&mut fastrand::Rng::with_seed(9));
    let mut task = task(&truth[..1], &board, sights);
    (task.lens, task.wants_rig) = (LensKind::Fisheye, false);
    let outcome = calibrate(&task).unwrap();
    let found = outcome.cameras[0].camera.intrinsics;
    assert!((found.fx / 420.0 - 1.0).abs() < 5e-3, "{found:?}");
    assert!(outcome.cameras[0].rms_px < 0.4);
}

#[test]
fn the_orientation_of_a_symmetric_board_is_decided_by_all_cameras_together() {
    let truth = ring(4, BROWN);
    let board = board(6, 4);
    let show = Show {
        cameras: &truth,
        board: &board,
        n_frames: 80,
        noise_px: 0.1,
    };
    let turned: Vec<usize> = (0..24).rev().collect();
    let mut random = fastrand::Rng::with_seed(4);
    let sights = show.sights(&mut random).into_iter().map(|sight| {
        let is_turned = random.bool();
        if is_turned {
            sight.renumbered(&turned, &board)
        } else {
            sight
        }
    });
    let sights = sights.collect();
    let mut task = task(&truth, &board, sights);
    task.look_alikes = vec![turned];
    let outcome = calibrate(&task).unwrap();
    let [focal, turn, place] = errors(&outcome, &truth);
    assert!(
        focal < 4e-3 && turn < 0.6 && place < 1e-2,
        "{focal} {turn} {place}"
    );
    assert!(outcome.cameras.iter().all(|camera| camera.wrong_share() < 0.02));
}

#[test]
fn pictures_that_do_not_determine_the_cameras_are_refused_with_the_reason() {
    let truth = ring(4, BROWN);
    let board = board(6, 4);
    let show = Show {
        cameras: &truth,
        board: &board,
        n_frames: 60,
        noise_px: 0.2,
    };
    let sights = show.sights(&mut fastrand::Rng::with_seed(3));
    // Cameras 0 and 1 never see the board at the same time as cameras 2 and 3.
    let apart = sights.iter().filter(|sight| (sight.camera < 2) == (sight.frame % 2 == 0));
    let error = calibrate(&task(&truth, &board, apart.cloned().collect())).unwrap_err();
    assert!(
        error.to_string().contains("cam0, cam1 | cam2, cam3"),
        "{error}"
    );
    let none = sights.iter().filter(|sight| sight.camera != 2).cloned().collect();
    let error = calibrate(&task(&truth, &board, none)).unwrap_err();
    assert!(
        error.to_string().contains("\"cam2\" saw the board in 0 pictures"),
        "{error}"
    );
    let few = sights.iter().filter(|sight| sight.frame < 9).cloned().collect();
    match calibrate(&task(&truth, &board, few)) {
        Ok(outcome) => assert!(!outcome.doubts.is_empty()),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

#[test]
fn unsynchronised_cameras_are_reported() {
    let truth = ring(3, BROWN);
    let board = board(6, 4);
    let show = Show {
        cameras: &truth,
        board: &board,
        n_frames: 90,
        noise_px: 0.2,
    };
    let mut sights = show.sights(&mut fastrand::Rng::with_seed(3));
    for sight in &mut sights {
        // One camera is a frame behind.
        sight.frame += usize::from(sight.camera == 1);
    }
    match calibrate(&task(&truth, &board, sights)) {
        Ok(outcome) => assert!(
            outcome.doubts.iter().any(|doubt| matches!(doubt, Doubt::Disagreement { .. })),
            "{:?}",
            outcome.doubts
        ),
        Err(error) => assert!(matches!(error, BoardError::Apart { .. }), "{error}"),
    }
}

#[test]
fn a_two_sided_board_connects_opposite_cameras() {
    let truth = [ring(4, BROWN)[0].clone(), ring(4, BROWN)[2].clone()];
    let board = board(6, 4);
    let random = &mut fastrand::Rng::with_seed(5);
    let mut sights = Vec::new();
    for frame in 0..60 {
        let pose = somewhere(random);
        for camera in truth.iter().enumerate() {
            let noise = &mut || noisy(random, 0.2);
            sights.extend(seen(camera, (&board, &pose), (frame, true), noise));
        }
    }
    let outcome = calibrate(&task(&truth, &board, sights)).unwrap();
    assert_eq!(outcome.doubts, []);
    let [focal, degrees, share] = errors(&outcome, &truth);
    assert!(
        focal < 0.01 && degrees < 0.3 && share < 0.01,
        "{focal} {degrees} {share}"
    );
    assert!(outcome.pairs[0].n > 20, "{:?}", outcome.pairs);
}

/// A board that is carried from place to place, seen by cameras whose pictures of a frame are fractions of a frame apart.
struct Carried<'a> {
    truth: &'a [Camera],
    board: &'a [Point2<f64>],
    /// Number of frames in which the board is held still at every place.
    n_held: usize,
    /// Step between frames that are used.
    every: usize,
}

impl Carried<'_> {
    fn sights(&self, seed: u64) -> Vec<Sight> {
        const N_CARRIED: usize = 12;
        let random = &mut fastrand::Rng::with_seed(seed);
        let places: Vec<Isometry3<f64>> = (0..24).map(|_| somewhere(random)).collect();
        let period = self.n_held + N_CARRIED;
        let at = |time: f64| {
            let nth = (time.max(0.0) as usize / period).min(places.len() - 2);
            let since = time - (nth * period + self.n_held) as f64;
            let share = (since / N_CARRIED as f64).clamp(0.0, 1.0);
            places[nth].lerp_slerp(&places[nth + 1], share)
        };
        let mut sights = Vec::new();
        for (nth_frame, frame) in (0..period * (places.len() - 1)).step_by(self.every).enumerate() {
            for (nth, camera) in self.truth.iter().enumerate() {
                let late = [0.0, 0.8, -0.7][nth % 3];
                let noise = &mut || noisy(random, 0.2);
                let pose = at(frame as f64 + late);
                let shown = (nth_frame, false);
                sights.extend(seen((nth, camera), (self.board, &pose), shown, noise));
            }
        }
        sights
    }
}

/// Returns the errors of focal lengths, rotations and positions along each axis, in stated standard deviations.
fn errors_in_deviations(outcome: &Outcome, truth: &[Camera]) -> Vec<f64> {
    let mut list = Vec::new();
    let first = truth[0].camera_from_world;
    for (nth, (found, truth)) in outcome.cameras.iter().zip(truth).enumerate() {
        let sd = |name: &str| found.numbers.iter().find(|number| number.name == name).unwrap().sd;
        let [own, focal] = [&found.camera, truth].map(|camera| camera.intrinsics.fx);
        list.push((own - focal) / sd("focal length"));
        if nth == 0 {
            continue;
        }
        let expected = truth.camera_from_world * first.inverse();
        let turn = found.camera.camera_from_world.rotation * expected.rotation.inverse();
        let place = found.camera.centre_in_world().coords - expected.inverse().translation.vector;
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            let degrees = turn.scaled_axis()[axis].to_degrees();
            list.push(degrees / sd(&format!("rotation {name}")));
            list.push(place[axis] / sd(&format!("place {name}")));
        }
    }
    list
}

#[test]
fn unsynchronised_cameras_get_lenses_from_their_own_pictures_and_given_offsets_are_used() {
    let truth = ring(3, BROWN);
    let board = board(6, 4);
    let mut errors_stated = Vec::new();
    // With few frames, an adjustment of all cameras has residuals that are hardly larger than those of each camera alone, because it
    // distorts lenses by up to a quarter.
    for (n_held, every, seed) in [(8, 1, 7), (0, 1, 7), (3, 1, 2), (8, 6, 3), (0, 6, 4)] {
        let carried = Carried {
            truth: &truth,
            board: &board,
            n_held,
            every,
        };
        let outcome = calibrate(&task(&truth, &board, carried.sights(seed))).unwrap();
        assert!(outcome.out_of_step.is_some(), "{n_held} {every}");
        let [focal, degrees, share] = errors(&outcome, &truth);
        assert!(focal < 0.03, "{n_held} {every}: {focal}");
        let is_place = |doubt: &Doubt| matches!(doubt, Doubt::Place { .. });
        let is_doubted = outcome.doubts.iter().any(is_place);
        let is_near = degrees < 0.5 && share < 0.02;
        assert!(is_doubted || is_near, "{degrees} {share}");
        errors_stated.extend(errors_in_deviations(&outcome, &truth));
    }
    let within = |n: f64| {
        errors_stated.iter().filter(|errors_stated| errors_stated.abs() < n).count() as f64
    };
    let shares = [within(2.0), within(4.0)].map(|n| n / errors_stated.len() as f64);
    assert!(shares[0] > 0.85 && shares[1] > 0.98, "{shares:?}");
}
