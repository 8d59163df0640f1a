//! Tests of the stature.

use nalgebra::{Point3, Rotation3, Vector3};

use super::*;
use crate::body::testing::{self, POSTURES};

fn stature_of(joints: &Joints) -> f64 {
    stature(joints).unwrap().metres
}

#[test]
fn a_mean_body_has_its_stature_in_every_posture() {
    for tall in [0.95, 1.1, 1.3, 1.62, 1.76, 2.1] {
        for posture in POSTURES {
            let found = stature(&posture(tall)).unwrap();
            assert!((found.metres - tall).abs() < 1e-3, "{tall} {found:?}");
            assert!((0.01..0.1).contains(&(found.sd / tall)), "{tall} {found:?}");
        }
    }
}

#[test]
fn one_limb_that_is_wrong_changes_little() {
    let mut joints = testing::walking(1.7);
    for joint in [6, 7] {
        joints[joint] = joints[joint].map(|joint| joint + Vector3::new(0.8, 0.0, 0.0));
    }
    assert!(
        (stature_of(&joints) - 1.7).abs() < 0.05,
        "{}",
        stature_of(&joints)
    );
}

#[test]
fn scaling_an_adult_scales_the_stature() {
    let joints = testing::bent(1.7);
    let scaled = joints.map(|joint| joint.map(|joint| joint * 1.2));
    assert!((stature_of(&scaled) - 1.2 * stature_of(&joints)).abs() < 1e-9);
}

#[test]
fn rotating_moving_and_mirroring_do_not_change_the_stature() {
    let joints = testing::noisy(
        &testing::sitting(1.6),
        0.05,
        0.02,
        &mut fastrand::Rng::with_seed(1),
    );
    let turn = Rotation3::from_euler_angles(0.3, 1.0, -2.0);
    let moved = joints.map(|joint| joint.map(|joint| turn * joint + Vector3::new(5.0, -3.0, 1.0)));
    assert!((stature_of(&moved) - stature_of(&joints)).abs() < 1e-9);
    assert_eq!(stature_of(&testing::mirrored(&joints)), stature_of(&joints));
}

#[test]
fn the_uncertainty_covers_the_noise() {
    let mut random = fastrand::Rng::with_seed(2);
    let errors: Vec<f64> = (0..400)
        .map(|_| {
            let found = stature(&testing::noisy(
                &testing::walking(1.7),
                0.05,
                0.03,
                &mut random,
            ))
            .unwrap();
            (found.metres - 1.7) / found.sd
        })
        .collect();
    let n_beyond = errors.iter().filter(|error| error.abs() > 2.0).count();
    assert!(n_beyond < 30, "{n_beyond}");
}

#[test]
fn too_few_bones_give_no_stature() {
    let arm = testing::standing(1.7);
    let arm: Joints = core::array::from_fn(|i| arm[i].filter(|_| (6..9).contains(&i) || i == 12));
    assert_eq!(stature(&arm), None);
    assert_eq!(stature(&[None; 14]), None);
    assert_eq!(stature(&[Some(Point3::new(f64::NAN, 0.0, 0.0)); 14]), None);
}
