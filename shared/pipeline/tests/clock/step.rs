//! Tests with cameras whose pictures were not taken at the times of their timestamps.

use geometry::{Camera, RigWatch, Step, StepWatch};
use nalgebra::{Isometry3, Vector3};
use scene::Action;

use crate::film::{Film, RATE_HZ};

/// Returns the offsets found after a number of frames.
///
/// * `late_ms`: delay of every camera's pictures behind their timestamps at a frame, in milliseconds.
/// * `skews_ms`: delay of the timestamps behind the instants, in milliseconds.
/// * `calibrated`: the cameras as assumed by the watch.
fn watch(
    film: &mut Film,
    n_frames: u32,
    late_ms: impl Fn(usize, u32) -> f64,
    skews_ms: &[f64],
    calibrated: &[Camera],
) -> StepWatch {
    let mut watch = StepWatch::new(calibrated.to_vec());
    let cameras = film.cameras().to_vec();
    let skews_s: Vec<f64> = skews_ms.iter().map(|skews_ms| skews_ms * 1e-3).collect();
    for frame in 0..n_frames {
        let instant_s = f64::from(frame) / RATE_HZ;
        let mut views = Vec::new();
        for (view, camera) in cameras.iter().enumerate() {
            let taken_s = instant_s + skews_s[view] + 1e-3 * late_ms(view, frame);
            let noise = film.noise();
            let points = film.see(camera, taken_s, &noise);
            views.push(Some(points.map(|point| [point.x, point.y]).to_vec()));
        }
        watch.note(instant_s, &views, &skews_s);
    }
    watch
}

fn steps(watch: &StepWatch, n: usize) -> Vec<Option<Step>> {
    (0..n).map(|view| watch.step(view)).collect()
}

#[test]
fn simulated_offsets_are_found_and_named() {
    for (rig, n) in [("ring:4", 4), ("humaneva", 3)] {
        let mut film = Film::new(rig, Action::Walking, 1);
        let cameras = film.cameras().to_vec();
        for (late, seed) in [(10.0, 1), (20.0, 2), (40.0, 3), (-20.0, 4)] {
            film.reseed(seed);
            let of = |view: usize, _: u32| if view == 1 { late } else { 0.0 };
            let watch = watch(&mut film, 600, of, &vec![0.0; n], &cameras);
            let found = steps(&watch, n);
            println!("{rig}, {late} ms planted: {found:?}");
            for (view, step) in found.iter().enumerate() {
                let step = step.expect("a person who walks is enough");
                let off = step.offset_ms - of(view, 0);
                assert!(off.abs() < 3.0, "{rig} {late}: {view} {step:?}");
                assert_eq!(watch.is_reported(view), view == 1, "{rig} {late}: {view}");
            }
        }
    }
}

#[test]
fn synchronised_cameras_give_no_offset() {
    let mut worst: f64 = 0.0;
    for action in [Action::Walking, Action::Boxing] {
        let mut film = Film::new("ring:4", action, 2);
        let cameras = film.cameras().to_vec();
        for seed in 0..20 {
            film.reseed(seed);
            // Skews that the timestamps already report are not offsets.
            let watch = watch(
                &mut film,
                400,
                |_, _| 0.0,
                &[0.0, 5.0, -11.0, 16.0],
                &cameras,
            );
            for view in 0..4 {
                let off = watch.step(view).map_or(0.0, |step| step.offset_ms);
                worst = worst.max(off.abs());
                assert!(!watch.is_reported(view), "{seed}: {off}");
            }
        }
    }
    println!("largest offset of 160 cameras in step: {worst:.2} ms");
}

#[test]
fn a_still_person_gives_no_offset() {
    let mut film = Film::new("ring:4", Action::Lying, 1);
    let cameras = film.cameras().to_vec();
    let mut watch = StepWatch::new(cameras.clone());
    for frame in 0..600 {
        let views = cameras.iter().map(|camera| {
            let noise = film.noise();
            Some(film.see(camera, 1.0, &noise).map(|point| [point.x, point.y]).to_vec())
        });
        watch.note(
            f64::from(frame) / RATE_HZ,
            &views.collect::<Vec<_>>(),
            &[0.0; 4],
        );
    }
    assert_eq!(steps(&watch, 4), [None; 4]);
}

#[test]
fn a_moved_camera_is_not_reported_as_unsynchronised() {
    let mut film = Film::new("ring:4", Action::Walking, 2);
    let mut calibrated = film.cameras().to_vec();
    let turn = Isometry3::rotation(Vector3::new(0.01, 0.03, 0.0));
    let push = Isometry3::translation(0.1, 0.0, -0.05);
    let more = Isometry3::rotation(Vector3::new(-0.04, 0.05, 0.02));
    for (name, moved) in [("turned", turn), ("pushed", push), ("turned more", more)] {
        calibrated[2].camera_from_world = moved * film.cameras()[2].camera_from_world;
        let watch = watch(&mut film, 600, |_, _| 0.0, &[0.0; 4], &calibrated);
        println!("{name}: {:?}", steps(&watch, 4));
        assert!(
            (0..4).all(|view| !watch.is_reported(view)),
            "{name}: {:?}",
            steps(&watch, 4)
        );
    }
}

#[test]
fn a_late_camera_that_looks_moved_is_reported_as_late() {
    let mut film = Film::new("ring:4", Action::Walking, 1);
    let cameras = film.cameras().to_vec();
    let mut moved = RigWatch::new(cameras.clone());
    for frame in 0..300 {
        let views = cameras.iter().enumerate().map(|(view, camera)| {
            let late_s = if view == 1 { 0.06 } else { 0.0 };
            let noise = film.noise();
            let points = film.see(camera, f64::from(frame) / RATE_HZ + late_s, &noise);
            Some(points.map(|point| [point.x, point.y]).to_vec())
        });
        moved.note(&views.collect::<Vec<_>>());
    }
    let late = |view: usize, _: u32| if view == 1 { 60.0 } else { 0.0 };
    let step = watch(&mut film, 600, late, &[0.0; 4], &cameras);
    let looks_moved: Vec<usize> = (0..4).filter(|view| moved.is_reported(*view)).collect();
    println!("60 ms late: {:?}", steps(&step, 4));
    assert_eq!(looks_moved, [1]);
    let is_late: Vec<usize> = (0..4).filter(|view| step.is_reported(*view)).collect();
    assert_eq!(is_late, [1]);
}

#[test]
fn a_drifting_camera_is_named_once_its_offset_is_large() {
    let mut film = Film::new("ring:4", Action::Walking, 1);
    let cameras = film.cameras().to_vec();
    // A drift of 1 ms per second: thirty times the drift of real clocks.
    let drift = |view: usize, frame: u32| {
        if view == 3 {
            f64::from(frame) / RATE_HZ
        } else {
            0.0
        }
    };
    let early = watch(&mut film, 330, drift, &[0.0; 4], &cameras);
    assert!((0..4).all(|view| !early.is_reported(view)));
    let late = watch(&mut film, 900, drift, &[0.0; 4], &cameras);
    let reported: Vec<usize> = (0..4).filter(|view| late.is_reported(*view)).collect();
    assert_eq!(reported, [3]);
}

#[test]
fn with_two_cameras_each_gets_half_of_the_offset() {
    let mut film = Film::new("ring:2", Action::Walking, 1);
    let cameras = film.cameras().to_vec();
    let late = |view: usize, _: u32| if view == 0 { 30.0 } else { 0.0 };
    let found = steps(&watch(&mut film, 600, late, &[0.0; 2], &cameras), 2);
    println!("two cameras 30 ms apart: {found:?}");
    for (step, expected) in found.into_iter().zip([15.0, -15.0]) {
        let step = step.expect("movement enough");
        assert!((step.offset_ms - expected).abs() < 3.0, "{step:?}");
    }
}

#[test]
fn missing_and_invalid_values_are_left_out() {
    let mut film = Film::new("ring:2", Action::Walking, 1);
    let cameras = film.cameras().to_vec();
    let mut watch = StepWatch::new(cameras);
    let nothing = [f64::NAN; 2];
    for frame in 0..400_u32 {
        let views = [None, Some(vec![nothing; 14])];
        watch.note(f64::from(frame) / RATE_HZ, &views, &[0.0; 2]);
        watch.note(f64::NAN, &[Some(vec![[1.0, 2.0]; 3])], &[]);
    }
    assert_eq!(steps(&watch, 3), [None; 3]);
    film.reseed(0);
}
