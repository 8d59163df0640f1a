//! Tests of the learned lengths.

use nalgebra::Vector3;

use super::*;
use crate::body::check::check;
use crate::body::testing::{self, NO_COVARIANCES};

fn add(lengths: &mut Lengths, joints: &Joints) {
    lengths.add(
        joints,
        &check(joints, &NO_COVARIANCES, Some(&lengths.clone())),
    );
}

#[test]
fn lengths_are_learned_from_noisy_frames() {
    let mut lengths = Lengths::default();
    let mut random = fastrand::Rng::with_seed(7);
    let person = testing::walking(1.8);
    for frame in 0..MAX_FRAMES + 60 {
        assert_eq!(lengths.n_learned() > 0, frame >= MIN_FRAMES);
        add(
            &mut lengths,
            &testing::noisy(&person, 0.02, 0.02, &mut random),
        );
    }
    for (i, bone) in BONES.iter().enumerate() {
        let (found, truth) = (lengths.bone(i).unwrap(), bone.length(&person).unwrap());
        assert!(
            (found.metres - truth).abs() < 0.012,
            "{} {found:?} {truth}",
            bone.name
        );
        assert!((0.002..0.02).contains(&found.sd), "{} {found:?}", bone.name);
    }
    assert_eq!(lengths.bone(N_BONES), None);
}

#[test]
fn implausible_frames_do_not_count() {
    let mut lengths = Lengths::default();
    let person = testing::standing(1.7);
    let mut wild = person;
    wild[6] = wild[6].map(|wild| wild + Vector3::new(0.0, 1.0, 0.0));
    let small = person.map(|joint| joint.map(|joint| joint * 0.3));
    for frame in 0..90 {
        add(&mut lengths, [&person, &wild, &small][frame % 3]);
    }
    let lower_arm = lengths.bone(5).unwrap();
    assert!((lower_arm.metres - BONES[5].length(&person).unwrap()).abs() < 1e-9);
    assert_eq!(lengths.frames[Kind::Head.index()].len(), 60);
}

#[test]
fn memory_is_bounded_and_the_last_frames_count() {
    let mut lengths = Lengths::default();
    for tall in [1.6, 1.7] {
        let person = testing::standing(tall);
        let verdict = check(&person, &NO_COVARIANCES, None);
        for _ in 0..MAX_FRAMES {
            lengths.add(&person, &verdict);
        }
        let trunk = lengths.bone(12).unwrap();
        assert!((trunk.metres - 0.3 * tall).abs() < 1e-9);
    }
    assert!(
        lengths
            .frames
            .iter()
            .all(|frame| frame.len() == MAX_FRAMES && frame.capacity() == MAX_FRAMES)
    );
}

#[test]
fn a_reset_removes_the_learned_lengths() {
    let mut lengths = Lengths::default();
    testing::learn(&mut lengths, &testing::standing(1.7));
    assert_eq!(lengths.n_learned(), N_BONES);
    lengths.reset();
    assert_eq!(lengths, Lengths::default());
}
