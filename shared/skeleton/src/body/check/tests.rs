//! Tests of the verdict.

use nalgebra::{Matrix3, Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::body::testing::{self, NO_COVARIANCES, POSTURES};

fn verdict(joints: &Joints) -> Verdict {
    check(joints, &NO_COVARIANCES, None)
}

fn moved(joints: &Joints, joint: usize, by: [f64; 3]) -> Joints {
    let mut joints = *joints;
    joints[joint] = joints[joint].map(|joint| joint + Vector3::from(by));
    joints
}

fn dropped(joints: &Joints) -> Vec<usize> {
    let verdict = verdict(joints);
    assert_eq!(verdict.nobody, None);
    (0..N_JOINTS).filter(|joint| verdict.dropped[*joint]).collect()
}

#[test]
fn men_women_and_children_are_possible_in_every_posture() {
    for tall in [0.95, 1.1, 1.3, 1.5, 1.62, 1.76, 2.1] {
        for posture in POSTURES {
            let found = verdict(&posture(tall));
            assert_eq!((found.nobody, found.dropped), (None, [false; 14]), "{tall}");
            assert!(found.deviation < 0.2, "{tall} {}", found.deviation);
        }
    }
}

#[test]
fn unusual_builds_are_possible() {
    // Legs or arms that are longer than average by three standard deviations among people.
    for (joints, share) in [([0, 1, 4, 5], 0.13), ([6, 7, 10, 11], 0.12)] {
        for tall in [0.95, 1.76] {
            let mut person = testing::standing(tall);
            let [end, middle, other_middle, other_end] = joints;
            let long = |of: f64| [0.0, 0.0, -share * of];
            let (upper, lower) = (0.22 * tall, 0.2 * tall);
            person = moved(&person, end, long(upper + lower));
            person = moved(&person, middle, long(upper));
            person = moved(&person, other_middle, long(upper));
            person = moved(&person, other_end, long(upper + lower));
            assert_eq!(dropped(&person), Vec::<usize>::new(), "{tall} {joints:?}");
        }
    }
}

#[test]
fn the_usual_errors_of_the_detector_are_possible() {
    let person = testing::walking(1.75);
    let mut high = person;
    for joint in [1, 2, 3, 4] {
        high = moved(&high, joint, [0.0, 0.0, 0.12]);
    }
    assert_eq!(dropped(&high), Vec::<usize>::new());
    let mut random = fastrand::Rng::with_seed(1);
    let n_dropped: usize = (0..300)
        .map(|_| dropped(&testing::noisy(&person, 0.07, 0.03, &mut random)).len())
        .sum();
    assert!(n_dropped < 42, "{n_dropped} of 4200");
}

#[test]
fn a_child_is_possible_with_noise() {
    let mut random = fastrand::Rng::with_seed(2);
    let person = testing::walking(0.95);
    let n_nobody = (0..300)
        .filter(|_| verdict(&testing::noisy(&person, 0.04, 0.02, &mut random)).nobody.is_some())
        .count();
    assert!(n_nobody < 6, "{n_nobody}");
}

#[test]
fn a_tiny_skeleton_on_the_chest_of_a_person_is_rejected() {
    for posture in POSTURES {
        let person = posture(1.76);
        let small = person.map(|joint| joint.map(|joint| joint * (0.72 / 1.76)));
        let reason = verdict(&small).nobody;
        let Some(Reason::Stature { metres, limits }) = reason else {
            panic!("{reason:?}");
        };
        assert!(metres < limits[0], "{metres}");
        assert_eq!(verdict(&small).keep(&small), [None; 14]);
    }
}

#[test]
fn a_giant_is_rejected() {
    let giant = testing::standing(1.7).map(|joint| joint.map(|joint| joint * 1.5));
    assert!(matches!(
        verdict(&giant).nobody,
        Some(Reason::Stature { .. })
    ));
}

#[test]
fn random_joints_are_rejected() {
    let mut random = fastrand::Rng::with_seed(3);
    let mut n_nobody = 0;
    for _ in 0..200 {
        let mut at = || 3.0 * random.f64();
        let thrown: Joints = core::array::from_fn(|_| Some(Point3::new(at(), at(), at())));
        n_nobody += usize::from(verdict(&thrown).nobody.is_some());
    }
    assert!(n_nobody > 190, "{n_nobody} of 200");
}

#[test]
fn an_arm_over_a_metre_long_loses_its_joint() {
    let person = testing::walking(1.75);
    assert_eq!(dropped(&moved(&person, 6, [0.7, 0.0, 0.0])), [6]);
    assert_eq!(dropped(&moved(&person, 11, [0.0, 0.7, 0.3])), [11]);
    // The elbow makes both bones impossible; the wrist may stay because it is within reach.
    assert_eq!(dropped(&moved(&person, 7, [0.7, 0.3, 0.0])), [7]);
    // Both joints are dropped: without the elbow, the wrist is not connected to anything, and is out of reach.
    let both = moved(&moved(&person, 7, [0.8, 0.0, 0.0]), 6, [-0.3, -1.2, 0.0]);
    assert_eq!(dropped(&both), [6, 7]);
}

#[test]
fn every_outlying_joint_is_removed_and_no_other() {
    for posture in POSTURES {
        let person = posture(1.7);
        for joint in 0..N_JOINTS {
            assert_eq!(dropped(&moved(&person, joint, [1.5, 1.2, 0.8])), [joint]);
        }
    }
}

#[test]
fn a_leg_without_length_loses_a_joint() {
    let mut person = testing::standing(1.7);
    person[0] = person[1];
    assert_eq!(dropped(&person), [0]);
}

#[test]
fn a_wrist_whose_elbow_is_missing_is_judged_by_its_reach() {
    let mut person = testing::reaching(1.75);
    person[7] = None;
    assert_eq!(dropped(&person), Vec::<usize>::new());
    assert_eq!(dropped(&moved(&person, 6, [0.0, 0.0, 0.35])), [6]);
}

#[test]
fn sides_that_differ_too_much_lose_a_joint() {
    // Each of the lengths is possible on its own.
    let person = testing::standing(1.75);
    let uneven = moved(&moved(&person, 0, [0.0, 0.0, -0.15]), 5, [0.0, 0.0, 0.17]);
    assert_eq!(
        dropped(&moved(&person, 0, [0.0, 0.0, -0.15])),
        Vec::<usize>::new()
    );
    assert_eq!(
        dropped(&moved(&person, 5, [0.0, 0.0, 0.17])),
        Vec::<usize>::new()
    );
    assert_eq!(dropped(&uneven).len(), 1);
}

#[test]
fn of_two_similar_joints_the_less_certain_one_is_dropped() {
    let person = moved(&testing::standing(1.7), 2, [0.0, -0.25, 0.0]);
    let person = moved(&person, 3, [0.0, 0.25, 0.0]);
    for (joint, other) in [(2, 3), (3, 2)] {
        let mut covariances = [Some(Matrix3::identity() * 1e-4); N_JOINTS];
        covariances[joint] = Some(Matrix3::identity() * 1e-2);
        let found = check(&person, &covariances, None);
        assert!(found.dropped[joint] && !found.dropped[other], "{joint}");
    }
}

#[test]
fn too_few_bones_are_rejected() {
    let person = testing::standing(1.7);
    let arm: Joints = core::array::from_fn(|i| person[i].filter(|_| (6..9).contains(&i)));
    let reason = verdict(&arm).nobody;
    assert_eq!(
        reason,
        Some(Reason::TooFewBones {
            bones: 2,
            needed: 4
        })
    );
    assert!(reason.unwrap().to_string().contains("2 bones"));
    let upper: Joints = core::array::from_fn(|i| person[i].filter(|_| i > 5));
    assert_eq!(verdict(&upper).nobody, None);
}

#[test]
fn learned_lengths_narrow_the_limits() {
    let person = testing::walking(1.75);
    let mut lengths = Lengths::default();
    testing::learn(&mut lengths, &person);
    // The trunk is too short for this person, although it is possible for people in general.
    let short = moved(&person, 12, [0.0, 0.0, -0.225]);
    let trunk = |lengths| Judgement::new(&short, lengths).z[12].unwrap().abs();
    assert!(trunk(None) < LIMIT && trunk(Some(&lengths)) > LIMIT);
}

#[test]
fn the_person_that_was_learned_does_not_shrink() {
    let mut lengths = Lengths::default();
    testing::learn(&mut lengths, &testing::walking(1.65));
    let child = testing::sitting(1.1);
    assert_eq!(verdict(&child).nobody, None);
    let reason = check(&child, &NO_COVARIANCES, Some(&lengths)).nobody;
    assert!(matches!(reason, Some(Reason::Stature { .. })), "{reason:?}");
    // The same person, half hidden and in another posture, is accepted.
    let mut person = testing::reaching(1.65);
    for joint in [0, 1, 4, 5, 10, 11] {
        person[joint] = None;
    }
    assert_eq!(check(&person, &NO_COVARIANCES, Some(&lengths)).nobody, None);
}

#[test]
fn the_mirror_image_gives_the_mirrored_result() {
    let mut random = fastrand::Rng::with_seed(5);
    for _ in 0..100 {
        let person = testing::noisy(&testing::walking(1.6), 0.15, 0.1, &mut random);
        let (a, b) = (verdict(&person), verdict(&testing::mirrored(&person)));
        assert_eq!(testing::mirrored(&a.dropped), b.dropped);
        assert!((a.deviation - b.deviation).abs() < 1e-9);
        assert_eq!(a.nobody.is_some(), b.nobody.is_some());
    }
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -2.0..2.0_f64,
        1 => -1e9..1e9_f64,
        1 => prop::sample::select(vec![0.0, f64::NAN, f64::INFINITY, f64::MAX, 1e-300]),
    ]
}

fn joints() -> impl Strategy<Value = Joints> {
    let joint = prop::option::weighted(0.9, prop::array::uniform3(coordinate()));
    prop::collection::vec(joint, N_JOINTS)
        .prop_map(|joints| core::array::from_fn(|i| joints[i].map(Point3::from)))
}

fn covariances() -> impl Strategy<Value = Covariances> {
    let covariance = prop::option::of(prop::array::uniform9(coordinate()));
    prop::collection::vec(covariance, N_JOINTS).prop_map(|covariances| {
        core::array::from_fn(|i| covariances[i].map(|entries| Matrix3::from_row_slice(&entries)))
    })
}

proptest! {
    #[test]
    fn any_input_gives_finite_numbers(joints in joints(), covariances in covariances(), learned in any::<bool>()) {
        let mut lengths = Lengths::default();
        if learned {
            testing::learn(&mut lengths, &testing::walking(1.7));
        }
        let found = check(&joints, &covariances, Some(&lengths));
        prop_assert!(found.deviation.is_finite() && found.deviation >= 0.0);
        prop_assert!(found.stature.is_none_or(|stature| stature.metres.is_finite() && stature.sd.is_finite()));
        let kept = found.keep(&joints);
        if found.nobody.is_none() {
            // The kept joints are possible.
            let again = check(&kept, &covariances, Some(&lengths));
            prop_assert_eq!((again.nobody, again.dropped), (None, [false; N_JOINTS]));
        }
        lengths.add(&joints, &found);
        prop_assert!(crate::body::deviation(&joints).is_finite());
        let refined = crate::body::refine(&joints, &covariances, Some(&lengths));
        for i in 0..N_JOINTS {
            prop_assert_eq!(refined.joints[i].is_some(), clean(&joints)[i].is_some());
            prop_assert_eq!(refined.joints[i].is_some(), refined.covariances[i].is_some());
            prop_assert!(refined.joints[i].is_none_or(|joint| joint.iter().all(|x| x.is_finite())));
            prop_assert!(refined.covariances[i].is_none_or(|covariance| covariance.iter().all(|x| x.is_finite())));
        }
    }
}
