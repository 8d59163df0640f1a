//! Tests with rings of cameras around a walking person.

use super::testing::{Flaws, N_JOINTS, RADIUS, ring, sides};
use super::*;
use crate::differences;

fn settings() -> Settings {
    Settings {
        n_joints: N_JOINTS,
        sides: sides(),
        as_seen: false,
        offsets_s: Vec::new(),
        window_s: 0.0,
        scale: Scale::Rig,
        focal: false,
        most_instants: 90,
        seed: 1,
    }
}

/// Returns the cameras with uninformative poses.
fn nowhere(cameras: &[Camera]) -> Vec<Camera> {
    let each = cameras.iter().cloned();
    each.map(|camera| Camera {
        camera_from_world: nalgebra::Isometry3::identity(),
        ..camera
    })
    .collect()
}

/// Returns the largest errors of a rig: rotation in degrees, and position as a fraction of the radius.
fn worst(found: &[Camera], truth: &[Camera], with_scale: bool) -> [f64; 2] {
    let each = differences(found, truth, with_scale);
    each.iter().fold([0.0; 2], |worst, it| {
        [
            worst[0].max(it.turn.to_degrees()),
            worst[1].max(it.way / RADIUS),
        ]
    })
}

fn found(truth: &[Camera], flaws: &Flaws, settings: &Settings) -> Outcome {
    let films = flaws.films(truth);
    let recording = Recording {
        cameras: truth,
        films: &films,
    };
    estimate(&recording, settings).unwrap()
}

#[test]
fn the_height_of_the_person_and_the_feet_define_the_world() {
    let truth = ring(4);
    let films = Flaws::none(3).films(&truth);
    let given = nowhere(&truth);
    let recording = Recording {
        cameras: &given,
        films: &films,
    };
    let height = Settings {
        scale: Scale::Height(1.75),
        ..settings()
    };
    let outcome = estimate(&recording, &height).unwrap();
    assert_eq!(outcome.doubts, []);
    assert_eq!(outcome.vertical, Vertical::Feet);
    // The assumed body proportions are means, so the scale is known to a few percent.
    let heights = outcome.cameras.iter().zip(&truth);
    for (a, b) in heights {
        let [a, b] = [a, b].map(|camera| camera.centre_in_world().z);
        assert!((a - b).abs() < 0.15, "{a} m, not {b} m above the floor");
    }
    let across = Settings {
        scale: Scale::Distance(0, 2, 2.0 * RADIUS),
        ..height
    };
    let outcome = estimate(&recording, &across).unwrap();
    let [degrees, share] = worst(&outcome.cameras, &truth, false);
    assert!(degrees < 0.3 && share < 0.02, "{degrees} {share}");
}

#[test]
fn clock_offsets_are_estimated_together_with_the_cameras() {
    let truth = ring(4);
    let flaws = Flaws {
        offsets_s: vec![0.0, 0.04, -0.07, 0.02],
        ..Flaws::none(5)
    };
    let outcome = found(&truth, &flaws, &settings());
    assert_eq!(outcome.doubts, []);
    assert!(outcome.clocks_are_found);
    for (report, offset_s) in outcome.reports.iter().zip(&flaws.offsets_s) {
        let [found, _] = report.offset_s;
        assert!((found - offset_s).abs() < 0.004, "{found} {offset_s}");
    }
}

#[test]
fn given_clock_offsets_are_kept_if_the_joints_agree() {
    let truth = ring(3);
    let flaws = Flaws {
        offsets_s: vec![0.0, 0.04, -0.07],
        ..Flaws::usual(6)
    };
    let told = Settings {
        offsets_s: flaws.offsets_s.clone(),
        ..settings()
    };
    let outcome = found(&truth, &flaws, &told);
    assert_eq!(outcome.doubts, []);
    assert!(!outcome.clocks_are_found);
    let offsets = outcome.reports.iter().map(|report| report.offset_s);
    let given = flaws.offsets_s.iter().map(|offsets_s| [*offsets_s, 0.0]);
    assert!(offsets.eq(given), "{:?}", outcome.reports);
}

/// Shifts all joints of a camera by an amount that changes every half second.
fn drifting(films: &mut [Film], px: f64, seed: u64) {
    let mut random = fastrand::Rng::with_seed(seed);
    for film in films {
        let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
        let by: Vec<[f64; 2]> = (0..24).map(|_| [0; 2].map(|_| px * normal())).collect();
        for shot in &mut film.shots {
            let by = by[(2.0 * shot.time_s) as usize];
            let joints = shot.people.iter_mut().flat_map(|person| &mut person.joints);
            for it in joints.flatten() {
                it.at = [0, 1].map(|axis| it.at[axis] + by[axis]);
            }
        }
    }
}

#[test]
fn stated_deviations_match_the_errors_even_if_joint_errors_persist_over_time() {
    let truth = ring(4);
    let (mut squares, mut n) = ([0.0; 2], 0.0);
    for seed in 0..3 {
        let mut films = Flaws::none(20 + seed).films(&truth);
        drifting(&mut films, 4.0, seed);
        let recording = Recording {
            cameras: &truth,
            films: &films,
        };
        let outcome = estimate(&recording, &settings()).unwrap();
        assert_eq!(outcome.doubts, []);
        let apart = differences(&outcome.cameras, &truth, true);
        for (it, report) in apart.iter().zip(&outcome.reports) {
            squares[0] += (it.turn.to_degrees() / report.sd[0]).powi(2);
            squares[1] += (it.way / report.sd[1]).powi(2);
            n += 1.0;
        }
    }
    let ratios = squares.map(|square: f64| (square / n).sqrt());
    assert!(
        ratios.iter().all(|ratio| (0.5..1.6).contains(ratio)),
        "{ratios:?}"
    );
}

#[test]
fn an_uncertain_rig_is_reported_as_uncertain() {
    let truth = ring(3);
    let mut films = Flaws::none(4).films(&truth);
    drifting(&mut films, 4.0, 4);
    let recording = Recording {
        cameras: &truth,
        films: &films,
    };
    let outcome = estimate(&recording, &settings()).unwrap();
    assert_eq!(outcome.doubts, []);
    assert!(!outcome.cautions.is_empty(), "{:?}", outcome.reports);
    let text = outcome.cautions[0].text(&["a", "b", "c"]);
    assert!(text.contains("degrees and"), "{text}");
    // A well-known rig has no cautions.
    let outcome = found(&truth, &Flaws::none(4), &settings());
    assert_eq!(outcome.cautions, []);
}

#[test]
fn footage_that_does_not_determine_the_rig_is_refused() {
    let truth = ring(3);
    // Cameras that filmed at different times cannot be calibrated together.
    let mut films = Flaws::none(1).films(&truth);
    let far = Flaws::none(40).films(&truth);
    films[2] = far[2].clone();
    let recording = Recording {
        cameras: &truth,
        films: &films,
    };
    let outcome = estimate(&recording, &settings()).unwrap();
    assert!(!outcome.doubts.is_empty());

    // There are no people in the film of this camera.
    films[1] = Film::default();
    let recording = Recording {
        cameras: &truth,
        films: &films,
    };
    let outcome = estimate(&recording, &settings()).unwrap();
    assert!(matches!(
        outcome.doubts[..],
        [Doubt::NoPeople { camera: 1, .. }]
    ));
}

/// Number of recordings of each ring.
const N_SEEDS: u64 = 2;

#[test]
fn rings_of_cameras_are_found_and_wrong_results_are_refused() {
    for n in [3, 5] {
        let truth = ring(n);
        let (mut turns, mut ways, mut refused) = (Vec::new(), Vec::new(), 0);
        for seed in 0..N_SEEDS {
            let outcome = found(&truth, &Flaws::usual(100 + seed), &settings());
            let [degrees, share] = worst(&outcome.cameras, &truth, true);
            if !outcome.doubts.is_empty() {
                refused += 1;
                continue;
            }
            assert!(
                degrees < 1.0 && share < 0.03,
                "{n} cameras, seed {seed}: {degrees} {share}"
            );
            turns.push(degrees);
            ways.push(share);
        }
        turns.sort_by(f64::total_cmp);
        ways.sort_by(f64::total_cmp);
        assert!(refused <= N_SEEDS / 2, "{n}: {refused} refused");
        let [turn, way] = [&turns, &ways].map(|sorted| sorted[sorted.len() / 2]);
        assert!(
            turn < 0.3 && way < 0.01,
            "{n}: {turn} degrees, {way} of the radius"
        );
    }
}

/// Shifts each joint in every camera by a constant amount.
fn beside(films: &mut [Film], px: f64) {
    let mut random = fastrand::Rng::with_seed(8);
    for film in films {
        let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
        let by: Vec<[f64; 2]> = (0..N_JOINTS).map(|_| [0; 2].map(|_| px * normal())).collect();
        for person in film.shots.iter_mut().flat_map(|shot| &mut shot.people) {
            for (joint, by) in person.joints.iter_mut().zip(&by) {
                if let Some(it) = joint {
                    it.at = [0, 1].map(|axis| it.at[axis] + by[axis]);
                }
            }
        }
    }
}

#[test]
fn constant_errors_of_joints_are_not_mistaken_for_moved_cameras() {
    let truth = ring(4);
    let flaws = Flaws {
        size: 0.5,
        ..Flaws::none(12)
    };
    let mut films = flaws.films(&truth);
    beside(&mut films, 6.0);
    let recording = Recording {
        cameras: &truth,
        films: &films,
    };
    let outcome = estimate(&recording, &settings()).unwrap();
    assert_eq!(outcome.doubts, []);
    let [degrees, share] = worst(&outcome.cameras, &truth, true);
    assert!(degrees < 0.3 && share < 0.01, "{degrees} {share}");
}
