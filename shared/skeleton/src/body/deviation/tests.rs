//! Tests of the deviation.

use nalgebra::{Point3, Vector3};

use super::*;
use crate::body::testing::{self, POSTURES};

#[test]
fn people_of_all_ages_hardly_deviate() {
    for tall in [0.95, 1.3, 1.62, 1.76, 2.0] {
        for posture in POSTURES {
            let found = deviation(&posture(tall));
            assert!(found < 0.1, "{tall} {found}");
        }
    }
}

#[test]
fn usual_noise_gives_a_usual_deviation() {
    let mut random = fastrand::Rng::with_seed(1);
    let sum: f64 = (0..200)
        .map(|_| {
            deviation(&testing::noisy(
                &testing::walking(1.7),
                0.05,
                0.03,
                &mut random,
            ))
        })
        .sum();
    assert!((2.0..14.0).contains(&(sum / 200.0)), "{}", sum / 200.0);
}

#[test]
fn joints_that_are_not_a_person_deviate_more() {
    let person = testing::noisy(
        &testing::walking(1.7),
        0.03,
        0.03,
        &mut fastrand::Rng::with_seed(1),
    );
    let usual = deviation(&person);
    let scaled = |by: f64| deviation(&person.map(|joint| joint.map(|joint| joint * by)));
    assert!(scaled(0.4) > usual + 8.0, "{}", scaled(0.4));
    assert!(scaled(1.6) > usual + 8.0, "{}", scaled(1.6));
    let mut long = person;
    long[6] = long[6].map(|long| long + Vector3::new(1.0, 0.0, 0.0));
    assert!(deviation(&long) > usual + 5.0);
    let mut flat = person;
    for joint in [0, 1, 4, 5] {
        flat[joint] = flat[2];
    }
    assert!(deviation(&flat) > usual + 20.0);
}

#[test]
fn one_wrong_joint_counts_at_most_the_caps_of_its_bones() {
    let person = testing::standing(1.7);
    let mut wrong = person;
    wrong[6] = Some(Point3::new(500.0, 0.0, 0.0));
    assert!(deviation(&wrong) <= deviation(&person) + DEVIATION_CAP + 1.0);
}

#[test]
fn a_missing_joint_neither_helps_nor_hurts_much() {
    let person = testing::noisy(
        &testing::sitting(1.7),
        0.05,
        0.03,
        &mut fastrand::Rng::with_seed(4),
    );
    let mut without = person;
    without[11] = None;
    assert!((deviation(&without) - deviation(&person)).abs() < 3.0);
    assert_eq!(deviation(&[None; 14]), 18.0 * DEVIATION_CAP);
}

#[test]
fn the_mirror_image_deviates_as_much() {
    let person = testing::noisy(
        &testing::bent(1.8),
        0.1,
        0.1,
        &mut fastrand::Rng::with_seed(5),
    );
    let difference = deviation(&person) - deviation(&testing::mirrored(&person));
    assert!(difference.abs() < 1e-9);
}
