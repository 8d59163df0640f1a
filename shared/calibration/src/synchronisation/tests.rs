//! Tests with known offsets, and with footage that does not determine any.

use std::f64::consts::TAU;

use geometry::Camera;

use crate::synchronisation::testing::{
    Movement, N_JOINTS, Recording, ring, settings, stepping, walker,
};
use crate::synchronisation::{Doubt, Film, FilmError, Outcome, Settings, estimate};

const OFFSETS_S: [f64; 3] = [0.0, 0.31, -0.217];

fn recording(seconds: f64) -> Recording {
    Recording {
        offsets_s: OFFSETS_S.to_vec(),
        ..Recording::of(3, seconds).flawed(3)
    }
}

fn run(cameras: &[Camera], films: &[Film]) -> Outcome {
    estimate(cameras, films, &settings(1.0)).unwrap()
}

fn walking(time_s: f64) -> Vec<[[f64; 3]; N_JOINTS]> {
    vec![walker(time_s)]
}

#[track_caller]
fn check(outcome: &Outcome, truth_s: &[f64], most_s: f64) {
    assert_eq!(outcome.doubts, []);
    for (it, truth_s) in outcome.cameras.iter().zip(truth_s) {
        let off_s = it.offset_s - truth_s;
        assert!(off_s.abs() < most_s, "{off_s} of {truth_s}: {outcome:#?}");
    }
}

#[test]
fn six_seconds_of_walking_give_offsets_within_three_milliseconds() {
    let cameras = ring(3);
    let plain = recording(6.0);
    check(
        &run(&cameras, &plain.films(&cameras, &walking)),
        &OFFSETS_S,
        0.003,
    );
    let mixed = Recording {
        rates_hz: vec![30.0, 25.0, 60.0],
        ..plain
    };
    let two = |time_s: f64| vec![walker(time_s), stepping([-1.5, 0.5], 0.1, 0.0, 1.0)];
    check(
        &run(&cameras, &mixed.films(&cameras, &two)),
        &OFFSETS_S,
        0.003,
    );
}

#[test]
fn a_view_dependent_bias_of_joints_does_not_change_the_offsets() {
    let cameras = ring(3);
    let mut films = recording(6.0).films(&cameras, &walking);
    for (camera, film) in films.iter_mut().enumerate() {
        let people = film.shots.iter_mut().flat_map(|shot| &mut shot.people);
        for person in people {
            for (joint, found) in person.joints.iter_mut().enumerate() {
                let around = 2.0 * camera as f64 + 1.7 * joint as f64;
                if let Some(found) = found {
                    // The displacement is half the width of a joint.
                    found.at[0] += 8.0 * around.cos();
                    found.at[1] += 8.0 * around.sin();
                }
            }
        }
    }
    check(&run(&cameras, &films), &OFFSETS_S, 0.005);
}

#[test]
fn sides_as_seen_in_the_picture_do_not_matter_if_declared() {
    let cameras = ring(3);
    let films = Recording {
        exchanged: 0.0,
        ..recording(5.0)
    };
    let mut films = films.films(&cameras, &walking);
    for it in films[1].shots.iter_mut().flat_map(|shot| &mut shot.people) {
        let joints = it.joints.clone();
        it.joints = crate::synchronisation::testing::mirror().map(|joint| joints[joint]).to_vec();
    }
    let mirror = Some(crate::synchronisation::testing::mirror().to_vec());
    let settings = Settings {
        mirror,
        ..settings(1.0)
    };
    check(
        &estimate(&cameras, &films, &settings).unwrap(),
        &OFFSETS_S,
        0.004,
    );
}

#[test]
fn a_drift_is_estimated_from_long_enough_footage() {
    let cameras = ring(2);
    let films = Recording {
        rates_hz: vec![15.0; 2],
        offsets_s: vec![0.0, 0.2],
        drifts: vec![0.0, 1e-3],
        ..Recording::of(2, 30.0)
    };
    let outcome = run(&cameras, &films.films(&cameras, &walking));
    assert_eq!(outcome.doubts, []);
    let it = &outcome.cameras[1];
    let error = it.drift_error.unwrap();
    assert!((it.drift - 1e-3).abs() < (5.0 * error).max(1e-4), "{it:?}");
    let films = Recording {
        span: [0.0, 5.0],
        ..films
    };
    let outcome = run(&cameras, &films.films(&cameras, &walking));
    assert_eq!(outcome.cameras[1].drift_error, None);
}

/// Returns two people who work in one place, moving their arms slowly and hardly taking a step.
fn working(time_s: f64) -> Vec<[[f64; 3]; N_JOINTS]> {
    let person = |of: f64, [x, y]: [f64; 2]| {
        let place = [
            x + 0.15 * (0.31 * time_s + of).sin(),
            y + 0.12 * (0.23 * time_s + 2.0 * of).sin(),
        ];
        let turn = 0.4 + 0.5 * (0.17 * time_s + of).sin();
        let mut joints = stepping(place, turn, 0.0, 0.0);
        for (joint, reach) in [(6, 0.25), (7, 0.12), (10, 0.12), (11, 0.25)] {
            joints[joint][2] += reach * (0.9 * time_s + of + joint as f64).sin();
        }
        joints
    };
    vec![person(0.0, [0.8, 0.5]), person(1.7, [-0.9, -0.4])]
}

#[test]
fn slow_movement_gives_no_drift_and_no_overconfident_offset() {
    let cameras = ring(3);
    let films = Recording {
        rates_hz: vec![25.0; 3],
        noise_px: 4.0,
        ..recording(15.0)
    };
    let outcome = run(&cameras, &films.films(&cameras, &working));
    for (it, truth_s) in outcome.cameras.iter().zip(OFFSETS_S) {
        assert_eq!(it.drift, 0.0, "{it:?}");
        let off_s = (it.offset_s - truth_s).abs();
        let is_honest = off_s <= 4.0 * it.error_s;
        assert!(is_honest || !outcome.doubts.is_empty(), "{off_s}: {it:?}");
    }
}

#[test]
fn footage_without_offset_information_is_refused() {
    let cameras = ring(3);
    let plain = recording(6.0);
    let refused = |label: &str, outcome: &Outcome| {
        assert!(!outcome.doubts.is_empty(), "{label}: {outcome:#?}");
        let text = outcome.doubts[0].text(&["a", "b", "c"]);
        assert!(text.contains(char::is_numeric), "{label}: {text}");
    };
    let still: &Movement = &|_| vec![stepping([0.3, 0.2], 0.0, 0.0, 1.0)];
    refused(
        "nobody moves",
        &run(&cameras, &plain.films(&cameras, still)),
    );
    let treadmill: &Movement = &|time_s| vec![stepping([0.3, 0.2], 0.4, TAU * 2.0 * time_s, 1.0)];
    refused(
        "a treadmill",
        &run(&cameras, &plain.films(&cameras, treadmill)),
    );
    let films = plain.films(&cameras, &walking);
    let exchanged = [0, 2, 1].map(|i| cameras[i].clone());
    refused("cameras exchanged", &run(&exchanged, &films));
    let far = Recording {
        offsets_s: vec![0.0, 1.6, -0.2],
        ..plain
    };
    refused(
        "outside the search",
        &run(&cameras, &far.films(&cameras, &walking)),
    );
    let mut reversed = films.clone();
    let n = reversed[2].shots.len();
    for nth in 0..n / 2 {
        let (a, b) = (
            reversed[2].shots[nth].people.clone(),
            reversed[2].shots[n - 1 - nth].people.clone(),
        );
        (
            reversed[2].shots[nth].people,
            reversed[2].shots[n - 1 - nth].people,
        ) = (b, a);
    }
    refused("backwards", &run(&cameras, &reversed));
    let mut cut = films;
    let n = cut[1].shots.len();
    cut[1].shots.drain(n / 2..n / 2 + 8);
    for (nth, it) in cut[1].shots.iter_mut().enumerate() {
        it.time_s = nth as f64 / 30.0;
    }
    refused("frames missing", &run(&cameras, &cut));
}

#[test]
fn a_camera_without_people_is_named_and_the_others_get_offsets() {
    let cameras = ring(3);
    let mut films = recording(5.0).films(&cameras, &walking);
    let offsets_s = OFFSETS_S;
    for it in films[1].shots.iter_mut().flat_map(|shot| &mut shot.people) {
        for joint in it.joints.iter_mut().flatten() {
            joint.at[1] = f64::NAN;
        }
    }
    let outcome = run(&cameras, &films);
    let is_it = |doubt: &Doubt| matches!(doubt, Doubt::NoPeople { camera: 1, .. });
    assert!(outcome.doubts.iter().all(is_it), "{:?}", outcome.doubts);
    assert_eq!(outcome.doubts.len(), 1);
    let off_s = outcome.cameras[2].offset_s - offsets_s[2];
    assert!(off_s.abs() < 0.003, "{off_s}");
    let empty = vec![Film::default(); 3];
    assert_eq!(run(&cameras, &empty).doubts.len(), 3);
}

#[test]
fn impossible_joint_tracks_are_refused() {
    let cameras = ring(2);
    let film = |times: &[f64]| Film {
        shots: times
            .iter()
            .map(|&time_s| crate::synchronisation::Shot {
                time_s,
                people: Vec::new(),
            })
            .collect(),
    };
    let films = |times: &[f64]| [film(&[0.0, 0.1]), film(times)];
    let refused = |films: &[Film], settings: &Settings| {
        estimate(&cameras[..films.len().min(2)], films, settings).unwrap_err()
    };
    for times in [
        &[0.0, 0.0][..],
        &[0.1, 0.05],
        &[0.0, f64::NAN],
        &[f64::INFINITY],
    ] {
        let error = refused(&films(times), &settings(1.0));
        assert!(
            matches!(error, FilmError::Times { camera: 1, .. }),
            "{error}"
        );
    }
    let good = films(&[0.0, 0.1]);
    let error = refused(&good, &settings(f64::NAN));
    assert!(matches!(error, FilmError::Window { .. }));
    let other = Settings {
        reference: 2,
        ..settings(1.0)
    };
    assert!(matches!(
        refused(&good, &other),
        FilmError::Reference { .. }
    ));
    assert!(matches!(
        refused(&good[..1], &settings(1.0)),
        FilmError::OneCamera { .. }
    ));
}
