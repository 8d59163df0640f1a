//! Tests with poses whose angles are known.

use core::f64::consts::PI;

use nalgebra::{Rotation3, Unit};
use proptest::prelude::*;

use super::*;
use Side::{Left, Right};

/// Returns a body that stands upright and looks along x, with z up in the world, hanging arms and straight limbs.
fn standing() -> Vec<(Role, Vector3<f64>)> {
    // Axes: x forwards, y left, z up.
    let mut all = vec![
        (Role::Head, Vector3::new(0.0, 0.0, 1.75)),
        (Role::Neck, Vector3::new(0.0, 0.0, 1.5)),
    ];
    for (side, y) in [(Right, -1.0), (Left, 1.0)] {
        all.extend([
            (Role::Shoulder(side), Vector3::new(0.0, 0.2 * y, 1.45)),
            (Role::Elbow(side), Vector3::new(0.0, 0.2 * y, 1.15)),
            (Role::Wrist(side), Vector3::new(0.0, 0.2 * y, 0.9)),
            (Role::Hip(side), Vector3::new(0.0, 0.1 * y, 0.95)),
            (Role::Knee(side), Vector3::new(0.0, 0.1 * y, 0.5)),
            (Role::Ankle(side), Vector3::new(0.0, 0.1 * y, 0.1)),
            (Role::Heel(side), Vector3::new(-0.05, 0.1 * y, 0.02)),
            (Role::BigToe(side), Vector3::new(0.2, 0.1 * y, 0.02)),
        ]);
    }
    all
}

fn set(pose: &mut [(Role, Vector3<f64>)], role: Role, place: [f64; 3]) {
    for it in pose.iter_mut().filter(|pose| pose.0 == role) {
        it.1 = place.into();
    }
}

fn estimates(pose: &[(Role, Vector3<f64>)], sd_m: f64) -> Vec<(Role, Estimate)> {
    let estimate = |position: Vector3<f64>| Estimate {
        position,
        covariance: Some(Matrix3::identity() * sd_m * sd_m),
        state: State::Measured,
    };
    pose.iter().map(|pose| (pose.0, estimate(pose.1))).collect()
}

fn value_of(pose: &[(Role, Vector3<f64>)], angle: Angle) -> Result<Value, Unknown> {
    let all = angles(&estimates(pose, 0.002), Some(Vector3::z_axis()));
    all.into_iter().find(|entry| entry.0 == angle).unwrap().1
}

#[track_caller]
fn is(pose: &[(Role, Vector3<f64>)], angle: Angle, degrees: f64) {
    let got = value_of(pose, angle).unwrap().degrees;
    assert!(
        (got - degrees).abs() < 1e-6,
        "{angle}: {got}, expected {degrees}"
    );
}

#[test]
fn angles_of_upright_standing_are_zero_and_rotations_of_straight_limbs_are_missing() {
    let pose = standing();
    let defined = |entry: &(Angle, Result<Value, Unknown>)| entry.1.is_ok();
    let all = angles(&estimates(&pose, 0.002), Some(Vector3::z_axis()));
    for (angle, value) in all.iter().filter(|entry| defined(entry)) {
        assert!(value.unwrap().degrees.abs() < 1e-6, "{angle}");
    }
    for side in Side::BOTH {
        for angle in [
            Angle::HipRotation(side),
            Angle::ShoulderPlane(side),
            Angle::ShoulderRotation(side),
        ] {
            assert_eq!(value_of(&pose, angle), Err(Unknown::Undefined), "{angle}");
        }
    }
}

#[test]
fn a_lifted_thigh_is_flexion_and_a_spread_thigh_is_abduction() {
    for (side, y) in [(Right, -1.0), (Left, 1.0)] {
        let mut pose = standing();
        set(
            &mut pose,
            Role::Knee(side),
            [0.45 * 0.5, 0.1 * y, 0.95 - 0.45 * 0.75_f64.sqrt()],
        );
        is(&pose, Angle::HipFlexion(side), 30.0);
        is(&pose, Angle::HipAbduction(side), 0.0);
        let mut pose = standing();
        set(
            &mut pose,
            Role::Knee(side),
            [0.0, (0.1 + 0.45 * 0.5) * y, 0.95 - 0.45 * 0.75_f64.sqrt()],
        );
        is(&pose, Angle::HipAbduction(side), 30.0);
        is(&pose, Angle::HipFlexion(side), 0.0);
    }
}

#[test]
fn a_lower_leg_that_points_outwards_from_a_bent_knee_is_internal_rotation() {
    for (side, y) in [(Right, -1.0), (Left, 1.0)] {
        let mut pose = standing();
        let (sin, cos) = (PI / 6.0).sin_cos();
        // If the heel moves outwards, the front of the thigh rotates inwards.
        set(
            &mut pose,
            Role::Ankle(side),
            [-0.4 * cos, (0.1 + 0.4 * sin) * y, 0.5],
        );
        is(&pose, Angle::HipRotation(side), 30.0);
        is(&pose, Angle::KneeFlexion(side), 90.0);
    }
}

#[test]
fn arm_elevation_and_rotation_follow_the_isb_recommendation() {
    for (side, y) in [(Right, -1.0), (Left, 1.0)] {
        let mut sideways = standing();
        set(&mut sideways, Role::Elbow(side), [0.0, 0.5 * y, 1.45]);
        set(&mut sideways, Role::Wrist(side), [0.25, 0.5 * y, 1.45]);
        is(&sideways, Angle::ShoulderElevation(side), 90.0);
        is(&sideways, Angle::ShoulderPlane(side), 0.0);
        is(&sideways, Angle::ShoulderRotation(side), 0.0);
        is(&sideways, Angle::ElbowFlexion(side), 90.0);
        // The forearm points up, which is external rotation.
        set(&mut sideways, Role::Wrist(side), [0.0, 0.5 * y, 1.7]);
        is(&sideways, Angle::ShoulderRotation(side), -90.0);
        let mut forwards = standing();
        set(&mut forwards, Role::Elbow(side), [0.3, 0.2 * y, 1.45]);
        set(&mut forwards, Role::Wrist(side), [0.3, 0.2 * y, 1.7]);
        is(&forwards, Angle::ShoulderPlane(side), 90.0);
        is(&forwards, Angle::ShoulderRotation(side), -90.0);
    }
}

#[test]
fn a_trunk_leans_bends_and_turns() {
    let mut pose = standing();
    set(
        &mut pose,
        Role::Neck,
        [0.55 * 0.5, 0.0, 0.95 + 0.55 * 0.75_f64.sqrt()],
    );
    is(&pose, Angle::TrunkForwards, 30.0);
    is(&pose, Angle::TrunkSideways, 0.0);
    is(&pose, Angle::TrunkBend, 0.0);
    let mut pose = standing();
    set(
        &mut pose,
        Role::Neck,
        [0.0, -0.55 * 0.5, 0.95 + 0.55 * 0.75_f64.sqrt()],
    );
    is(&pose, Angle::TrunkSideways, 30.0);
    is(&pose, Angle::TrunkBend, 30.0);
    let mut pose = standing();
    set(&mut pose, Role::Shoulder(Right), [0.2, 0.0, 1.45]);
    set(&mut pose, Role::Shoulder(Left), [-0.2, 0.0, 1.45]);
    is(&pose, Angle::TrunkRotation, 90.0);
}

#[test]
fn toes_up_is_dorsiflexion() {
    let mut pose = standing();
    set(&mut pose, Role::BigToe(Right), [0.2, -0.1, 0.27]);
    is(&pose, Angle::AnkleDorsiflexion(Right), 45.0);
}

#[test]
fn without_feet_or_a_vertical_their_angles_are_missing() {
    let pose: Vec<_> = standing();
    let no_feet: Vec<_> =
        pose.iter().filter(|pose| !matches!(pose.0, Role::Heel(_))).copied().collect();
    assert_eq!(
        value_of(&no_feet, Angle::AnkleDorsiflexion(Left)),
        Err(Unknown::Missing)
    );
    let all = angles(&estimates(&pose, 0.01), None);
    assert_eq!(all[0], (Angle::TrunkForwards, Err(Unknown::Missing)));
}

#[test]
fn an_angle_without_data_is_missing() {
    let pose = standing();
    let all = angles(&estimates(&pose, 0.8), None);
    let knee = all.iter().find(|entry| entry.0 == Angle::KneeFlexion(Left)).unwrap();
    assert_eq!(knee.1, Err(Unknown::Uncertain));
    let mut unknown = estimates(&pose, 0.01);
    for it in &mut unknown {
        it.1.covariance = Some(Matrix3::from_element(f64::NAN));
    }
    let all = angles(&unknown, None);
    let knee = all.iter().find(|entry| entry.0 == Angle::KneeFlexion(Left)).unwrap();
    assert_eq!(knee.1.unwrap().sd_degrees, None);
}

/// Returns a pose in which every angle is defined.
fn bent() -> Vec<(Role, Vector3<f64>)> {
    let mut pose = standing();
    for (side, y) in [(Right, -1.0), (Left, 1.0)] {
        set(&mut pose, Role::Knee(side), [0.3, 0.15 * y, 0.65]);
        set(&mut pose, Role::Ankle(side), [0.1, 0.2 * y, 0.35]);
        set(&mut pose, Role::Heel(side), [0.05, 0.2 * y, 0.3]);
        set(&mut pose, Role::BigToe(side), [0.25, 0.25 * y, 0.25]);
        set(&mut pose, Role::Elbow(side), [0.15, 0.35 * y, 1.25]);
        set(&mut pose, Role::Wrist(side), [0.35, 0.2 * y, 1.35]);
    }
    pose
}

#[test]
fn the_deviation_of_an_angle_from_covariances_equals_that_from_sampling() {
    let mut random = fastrand::Rng::with_seed(4);
    let mut normal = || {
        let uniform: f64 = (0..12).map(|_| random.f64()).sum();
        uniform - 6.0
    };
    let (pose, sd_m) = (bent(), 0.01);
    let all = angles(&estimates(&pose, sd_m), Some(Vector3::z_axis()));
    let n = 1500;
    let mut sums = vec![0.0; all.len()];
    for _ in 0..n {
        let noise = |joint: &(Role, Vector3<f64>), normal: &mut dyn FnMut() -> f64| {
            (joint.0, joint.1 + Vector3::from_fn(|_, _| sd_m * normal()))
        };
        let moved: Vec<_> = pose.iter().map(|pose| noise(pose, &mut normal)).collect();
        for (at, it) in angles(&estimates(&moved, 1e-4), Some(Vector3::z_axis())).iter().enumerate()
        {
            let centre = all[at].1.unwrap().degrees;
            sums[at] += (it.1.unwrap().degrees - centre).powi(2);
        }
    }
    for ((angle, value), sum) in all.iter().zip(sums) {
        let (sampled, told) = (
            (sum / f64::from(n)).sqrt(),
            value.unwrap().sd_degrees.unwrap(),
        );
        assert!(
            (told / sampled - 1.0).abs() < 0.12,
            "{angle}: {told}, sampled {sampled}"
        );
    }
}

proptest! {
    #[test]
    fn angles_do_not_depend_on_where_the_person_stands(
        axis in prop::array::uniform3(-1.0..1.0_f64),
        turn in -3.0..3.0_f64,
        place in prop::array::uniform3(-5.0..5.0_f64),
    ) {
        let axis = Unit::try_new(Vector3::from(axis), 0.1);
        prop_assume!(axis.is_some());
        let rotation = Rotation3::from_axis_angle(&axis.unwrap(), turn);
        let up = Unit::new_normalize(rotation * Vector3::z());
        let moved: Vec<_> = bent().iter().map(|bent| (bent.0, rotation * bent.1 + Vector3::from(place))).collect();
        let before = angles(&estimates(&bent(), 0.01), Some(Vector3::z_axis()));
        let after = angles(&estimates(&moved, 0.01), Some(up));
        for (before, after) in before.iter().zip(&after) {
            let (a, b) = (before.1.unwrap(), after.1.unwrap());
            prop_assert!((a.degrees - b.degrees).abs() < 1e-6, "{}", before.0);
            prop_assert!((a.sd_degrees.unwrap() - b.sd_degrees.unwrap()).abs() < 0.05 * a.sd_degrees.unwrap(), "{}", before.0);
        }
    }

    #[test]
    fn angles_are_never_nan(places in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 18)) {
        let pose: Vec<_> = bent().iter().zip(&places).map(|(joint, place)| {
            // Moves every second joint to the same point.
            (joint.0, if place[0] > 0.0 { Vector3::zeros() } else { Vector3::from(*place) })
        }).collect();
        for (_, value) in angles(&estimates(&pose, 0.05), Some(Vector3::z_axis())) {
            if let Ok(value) = value {
                prop_assert!(value.degrees.is_finite() && value.sd_degrees.is_some_and(f64::is_finite));
            }
        }
    }
}
