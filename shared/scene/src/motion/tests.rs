//! Tests that joint limits and bone lengths are respected, that bodies stay above the floor, and that left and right are correct.

use proptest::prelude::*;

use super::*;
use crate::body::{
    ABDOMEN, CHEST, FOREARM, HAND, LEFT, LIMITS, N_BONES, PARENT, PELVIS, RIGHT, SHIN, THIGH,
};

fn acting(number: u64, action: Action, seed: u64) -> Motion {
    Motion::new(&Subject::new(number), action, seed)
}

fn action() -> impl Strategy<Value = Action> {
    prop::sample::select(Action::ALL.to_vec())
}

#[test]
fn every_action_is_found_by_its_name() {
    for action in Action::ALL {
        assert_eq!(Action::by_name(action.name()), Some(action));
    }
    assert_eq!(Action::by_name("flying"), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn joints_stay_within_their_limits_and_bones_keep_their_lengths(
        number in 0_u64..200, action in action(), seed in 0_u64..1000, seconds in 0.0..60.0,
    ) {
        let motion = acting(number, action, seed);
        let pose = motion.pose(seconds);
        let frames = motion.bones.frames(&pose);
        for bone in 0..N_BONES {
            for ([low, high], angle) in LIMITS[bone].iter().zip(pose.angles[bone]) {
                prop_assert!((*low..=*high).contains(&angle));
            }
            if let Some(parent) = PARENT[bone] {
                let length = (frames[bone].translation.vector - frames[parent].translation.vector).norm();
                prop_assert!((length - motion.bones.offset[bone].norm()).abs() < 1e-9);
            }
        }
    }

    /// Knees and elbows bend in one direction only; this is checked from the points alone.
    #[test]
    fn knees_and_elbows_never_bend_backwards(
        number in 0_u64..200, action in action(), seed in 0_u64..1000, seconds in 0.0..60.0,
    ) {
        let motion = acting(number, action, seed);
        let frames = motion.bones.frames(&motion.pose(seconds));
        for side in [LEFT, RIGHT] {
            let forward = |bone: usize| frames[bone].rotation * Vector3::x();
            let down = |from: usize, to: usize| {
                (frames[to].translation.vector - frames[from].translation.vector).normalize_or_zero()
            };
            let knee = down(SHIN[side], FOOT[side]).dot(&forward(THIGH[side]));
            prop_assert!(knee < 1e-9, "knee {}", knee);
            let elbow = down(FOREARM[side], HAND[side]).dot(&forward(UPPER_ARM[side]));
            prop_assert!(elbow > -1e-9, "elbow {}", elbow);
        }
    }

    #[test]
    fn people_are_on_the_floor_in_the_middle_of_the_room(
        number in 0_u64..200, action in action(), seed in 0_u64..1000, seconds in 0.0..60.0,
    ) {
        let motion = acting(number, action, seed);
        let frames = motion.bones.frames(&motion.pose(seconds));
        let lowest = motion.bones.lowest(&frames, motion.height());
        prop_assert!((-1e-9..0.12).contains(&lowest), "{}", lowest);
        let hips = frames[PELVIS].translation.vector;
        prop_assert!(hips.xy().norm() < 1.6, "{}", hips);
    }

    #[test]
    fn motion_has_no_jumps(
        number in 0_u64..200, action in action(), seed in 0_u64..1000, seconds in 0.0..60.0,
    ) {
        let motion = acting(number, action, seed);
        let joints = |at: f64| motion.bones.joints(&motion.bones.frames(&motion.pose(at)));
        for (a, b) in joints(seconds).iter().zip(joints(seconds + 1e-3)) {
            // 14 m/s is the speed of a boxer's hand.
            prop_assert!((a - b).norm() < 0.014, "{}", (a - b).norm());
        }
    }

    #[test]
    fn left_joints_are_on_the_left_of_the_trunk(
        number in 0_u64..200, action in action(), seed in 0_u64..1000, seconds in 0.0..60.0,
    ) {
        let motion = acting(number, action, seed);
        let frames = motion.bones.frames(&motion.pose(seconds));
        let joint = |bone: usize| frames[bone].translation.vector;
        let up = joint(CHEST) - joint(ABDOMEN);
        for (pair, trunk) in [(THIGH, PELVIS), (UPPER_ARM, CHEST)] {
            let forward = frames[trunk].rotation * Vector3::x();
            let left = joint(pair[LEFT]) - joint(pair[RIGHT]);
            prop_assert!(up.cross(&forward).dot(&left) > 0.0);
        }
    }
}

trait OrZero {
    fn normalize_or_zero(self) -> Self;
}

impl OrZero for Vector3<f64> {
    fn normalize_or_zero(self) -> Self {
        self.try_normalize(1e-12).unwrap_or_default()
    }
}

#[test]
fn motion_depends_on_the_seed_and_the_subject() {
    let at = |number, seed| acting(number, Action::Gestures, seed).pose(3.7);
    assert_eq!(at(1, 1), at(1, 1));
    assert_ne!(at(1, 1), at(1, 2));
    assert_ne!(at(1, 1), at(2, 1));
}
