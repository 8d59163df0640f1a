//! Tests of the smoother on tracks whose truth is known.

use super::*;
use crate::{Joint, Measured, Recorded, Role, Settings, Side, Sides, State};

/// Returns a number with an approximately standard normal distribution: the sum of 12 uniform numbers.
fn normal(random: &mut fastrand::Rng) -> f64 {
    (0..12).map(|_| random.f64()).sum::<f64>() - 6.0
}

/// Returns the position of a wrist that swings by 20 cm at 1 Hz, in metres.
fn swing(time: f64) -> Vector3<f64> {
    let turn = core::f64::consts::TAU * time;
    Vector3::new(
        0.2 * turn.sin(),
        0.1 * turn.cos(),
        1.0 + 0.05 * (2.0 * turn).sin(),
    )
}

/// Returns the swinging wrists of both sides, 60 cm apart, measured with uncorrelated errors.
fn recorded(rate_hz: f64, sd_m: f64, told_sd_m: f64, seconds: f64) -> Recorded {
    let mut random = fastrand::Rng::with_seed(5);
    let n = (rate_hz * seconds) as usize;
    let times: Vec<f64> = (0..n).map(|i| i as f64 / rate_hz).collect();
    let joints = Side::BOTH.map(|side| {
        let offset = if side == Side::Left { 0.6 } else { 0.0 };
        let mut measured = |time: &f64| {
            let error = Vector3::from_fn(|_, _| sd_m * normal(&mut random));
            Some(Measured {
                position: swing(*time + offset) + Vector3::new(0.0, offset, 0.0) + error,
                covariance: Some(Matrix3::identity() * told_sd_m * told_sd_m),
            })
        };
        Joint {
            name: format!("{} wrist", side.name()),
            role: Some(Role::Wrist(side)),
            measured: times.iter().map(&mut measured).collect(),
        }
    });
    Recorded {
        sides: vec![Sides::Sure; n],
        joints: joints.into(),
        times,
    }
}

fn error_m(recorded: &Recorded, track: &[crate::Smoothed]) -> f64 {
    let errors = track.iter().zip(&recorded.times);
    let errors: Vec<f64> = errors
        .filter_map(|(smoothed, time)| {
            Some((smoothed.ok()?.position - swing(*time)).norm_squared())
        })
        .collect();
    (errors.iter().sum::<f64>() / errors.len() as f64).sqrt()
}

#[test]
fn with_default_settings_noise_decreases_at_every_rate_and_error_size() {
    for rate_hz in [10.0, 30.0, 120.0] {
        for sd_m in [0.002, 0.05] {
            let recorded = recorded(rate_hz, sd_m, sd_m, 12.0);
            let got = crate::smooth(&recorded, &Settings::default());
            let error = error_m(&recorded, &got.joints[0]);
            let raw = sd_m * 3.0_f64.sqrt();
            let most = if rate_hz > 20.0 { 0.7 } else { 1.0 };
            assert!(
                error < most * raw,
                "{rate_hz} Hz, {sd_m} m: {error} of {raw}"
            );
        }
    }
}

#[test]
fn covariances_that_are_wrong_by_a_factor_are_scaled() {
    for told in [0.25, 1.0, 4.0] {
        let recorded = recorded(60.0, 0.02, 0.02 * told, 10.0);
        let got = crate::smooth(&recorded, &Settings::default());
        let scale = got.report.noise[0].unwrap().scale * told * told;
        assert!((0.8..1.25).contains(&scale), "{told}: {scale}");
    }
}

#[test]
fn smoothed_covariances_match_the_errors_of_the_smoothed_positions() {
    let recorded = recorded(60.0, 0.02, 0.02, 20.0);
    let got = crate::smooth(&recorded, &Settings::default());
    let told = got.joints[0].iter().map(|joint| joint.unwrap().covariance.unwrap().trace());
    let told = (told.sum::<f64>() / recorded.times.len() as f64).sqrt();
    let error = error_m(&recorded, &got.joints[0]);
    assert!((0.75..1.35).contains(&(told / error)), "{told} {error}");
}

#[test]
fn slow_errors_remain_in_the_covariances() {
    let recorded = recorded(60.0, 0.002, 0.02, 5.0);
    let got = crate::smooth(&recorded, &Settings::default());
    let told = got.joints[0][150].unwrap().covariance.unwrap();
    assert!((0.015..0.0205).contains(&told.m11.sqrt()), "{told}");
}

#[test]
fn outliers_are_rejected_and_short_gaps_filled_and_both_are_marked() {
    let mut recorded = recorded(60.0, 0.005, 0.005, 5.0);
    let track = &mut recorded.joints[0].measured;
    track[100].as_mut().unwrap().position.x += 0.4;
    track[150..158].fill(None);
    track[200..230].fill(None);
    track[..3].fill(None);
    let got = crate::smooth(&recorded, &Settings::default());
    let state = |at: usize| got.joints[0][at].map(|joint| joint.state);
    assert_eq!(state(100), Ok(State::Rejected));
    assert_eq!(state(154), Ok(State::Filled));
    assert_eq!(
        state(215),
        Err(crate::Absent::Gap),
        "half a second is too long"
    );
    assert_eq!(state(1), Err(crate::Absent::Gap), "nothing was before");
    assert!(error_m(&recorded, &got.joints[0]) < 0.006);
    let counts = got.report.counts[0];
    assert_eq!((counts.filled, counts.absent), (8, 33));
    assert!(counts.rejected < 4, "{counts:?}");
}

#[test]
fn swapped_wrists_are_corrected() {
    let mut recorded = recorded(60.0, 0.01, 0.01, 5.0);
    for at in 120..126 {
        let [a, b] = [0, 1].map(|i| recorded.joints[i].measured[at]);
        recorded.joints[0].measured[at] = b;
        recorded.joints[1].measured[at] = a;
    }
    let got = crate::smooth(&recorded, &Settings::default());
    for at in 120..126 {
        assert_eq!(
            got.joints[0][at].map(|joint| joint.state),
            Ok(State::Exchanged),
            "{at}"
        );
    }
    assert!(error_m(&recorded, &got.joints[0]) < 0.01);
}

#[test]
fn uncertain_sides_are_decided_by_the_frames_before_and_after() {
    let mut recorded = recorded(60.0, 0.01, 0.01, 5.0);
    for at in 60..240 {
        if at % 3 == 0 {
            recorded.sides[at] = Sides::Unsure;
        }
        if at % 6 == 0 {
            let [a, b] = [0, 1].map(|i| recorded.joints[i].measured[at]);
            recorded.joints[0].measured[at] = b;
            recorded.joints[1].measured[at] = a;
        }
    }
    let got = crate::smooth(&recorded, &Settings::default());
    assert_eq!(got.report.unsure, [30, 30, 0]);
    assert!(error_m(&recorded, &got.joints[0]) < 0.01);
}

#[test]
fn without_certain_sides_no_measurement_is_rejected() {
    let mut recorded = recorded(60.0, 0.01, 0.01, 2.0);
    recorded.sides.fill(Sides::Unsure);
    let got = crate::smooth(&recorded, &Settings::default());
    assert_eq!(got.report.counts[0].absent, 0);
    // Instants at which nobody is seen do not make the other instants lose their limbs.
    recorded.sides[..3].fill(Sides::Sure);
    for joint in &mut recorded.joints {
        joint.measured[..3].fill(None);
    }
    let got = crate::smooth(&recorded, &Settings::default());
    assert!(got.joints[0][3..].iter().all(Result::is_ok));
    assert_eq!(got.report.unsure, [recorded.times.len() - 3, 0, 0]);
}

#[test]
fn another_person_starts_a_new_track() {
    let mut recorded = recorded(60.0, 0.01, 0.01, 4.0);
    for joint in &mut recorded.joints {
        for it in joint.measured[120..].iter_mut().flatten() {
            it.position.x += 3.0;
        }
    }
    let got = crate::smooth(&recorded, &Settings::default());
    assert_eq!(got.report.breaks, [120]);
    let track = &got.joints[0];
    for at in [118, 119, 120, 121] {
        let offset = if at >= 120 { 3.0 } else { 0.0 };
        let away = track[at].unwrap().position - swing(recorded.times[at]) - Vector3::x() * offset;
        assert!(away.norm() < 0.05, "{at}: {away}");
    }
}

#[test]
fn bone_lengths_are_constant_on_request() {
    let mut recorded = recorded(60.0, 0.01, 0.01, 5.0);
    // The elbow is below the wrist, with errors of its own.
    let mut elbow = recorded.joints[0].clone();
    elbow.name = "right elbow".to_owned();
    elbow.role = Some(Role::Elbow(Side::Right));
    let mut random = fastrand::Rng::with_seed(9);
    for it in elbow.measured.iter_mut().flatten() {
        it.position +=
            Vector3::new(0.0, 0.0, -0.25) + Vector3::from_fn(|_, _| 0.01 * normal(&mut random));
    }
    recorded.joints.push(elbow);
    let settings = Settings {
        constant_bones: true,
        ..Settings::default()
    };
    let got = crate::smooth(&recorded, &settings);
    let [(ends, length)] = got.report.bones[..] else {
        panic!("one bone")
    };
    assert!((length - 0.25).abs() < 0.01, "{length}");
    for at in 0..recorded.times.len() {
        let [a, b] = ends.map(|end| got.joints[end][at].unwrap().position);
        assert!(((a - b).norm() - length).abs() < 1e-6, "{at}");
    }
}

#[test]
fn very_short_and_empty_tracks_are_smoothed_without_failure() {
    for n in [0, 1, 2, 3] {
        let mut recorded = recorded(60.0, 0.01, 0.01, 1.0);
        recorded.times.truncate(n);
        recorded.sides.truncate(n);
        for it in &mut recorded.joints {
            it.measured.truncate(n);
        }
        let got = crate::smooth(&recorded, &Settings::default());
        assert_eq!(got.joints[0].len(), n);
        assert!(got.joints[0].iter().all(Result::is_ok));
        for it in &mut recorded.joints {
            it.measured.fill(None);
        }
        let got = crate::smooth(&recorded, &Settings::default());
        assert!(got.joints[0].iter().all(Result::is_err));
    }
}

#[test]
fn invalid_numbers_and_irregular_times_are_tolerated() {
    let mut recorded = recorded(60.0, 0.01, 0.01, 3.0);
    for (at, it) in recorded.joints[0].measured.iter_mut().enumerate() {
        let it = it.as_mut().unwrap();
        match at % 4 {
            0 => it.covariance = Some(Matrix3::from_element(f64::NAN)),
            1 => it.covariance = None,
            2 if at % 40 == 2 => it.position.x = f64::NAN,
            _ => {}
        }
    }
    // The true positions are known at the original times.
    for (at, it) in recorded.times.iter_mut().enumerate() {
        *it += if at % 2 == 0 { 0.004 } else { 0.0 };
    }
    recorded.check().unwrap();
    let got = crate::smooth(&recorded, &Settings::default());
    for it in got.joints[0].iter().flatten() {
        assert!(it.position.iter().all(|x| x.is_finite()));
        assert!(it.covariance.unwrap().iter().all(|x| x.is_finite()));
    }
    assert!(error_m(&recorded, &got.joints[0]) < 0.02);
}
