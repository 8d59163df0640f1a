//! Tests that a recording of a generated action is reproduced.

use proptest::prelude::*;

use super::*;
use crate::motion::{Action, Motion};
use crate::subject::Subject;

/// Returns a perfect recording of a generated action.
fn recorded(number: u64, action: Action, rate_hz: f64, n: usize) -> (Recording, Motion) {
    let motion = Motion::new(&Subject::new(number), action, 7);
    let posture = |nth: usize| {
        let frames = motion.bones.frames(&motion.pose(nth as f64 / rate_hz));
        let toe = |side: usize| (frames[FOOT[side]] * Point3::from(motion.bones.sole[0])).coords;
        Posture {
            joints: motion.bones.joints(&frames).map(|joint| joint.coords.into()),
            toes: Some([toe(RIGHT).into(), toe(LEFT).into()]),
        }
    };
    let recording = Recording {
        name: "take".to_owned(),
        rate_hz,
        postures: (0..n).map(posture).collect(),
    };
    (recording, motion)
}

fn performed(recording: &Recording, number: u64) -> (Recorded, Bones, f64) {
    let subject = Subject::new(number);
    let bones = Bones::new(&subject.proportions);
    let height = subject.proportions.height;
    (Recorded::new(recording, &bones, height), bones, height)
}

#[test]
fn a_subject_with_its_own_recording_reproduces_the_recording() {
    for action in Action::ALL {
        let (recording, motion) = recorded(3, action, 25.0, 100);
        let (it, bones, _) = performed(&recording, 3);
        for nth in [0, 17, 54, 99] {
            let seconds = f64::from(nth) / 25.0;
            let got = bones.joints(&it.frames(seconds));
            let expected = motion.bones.joints(&motion.bones.frames(&motion.pose(seconds)));
            for joint in 0..N_JOINTS {
                // The joints alone do not determine where the trunk bends, and the whole path may be shifted.
                let error =
                    (got[joint] - got[NECK_JOINT]) - (expected[joint] - expected[NECK_JOINT]);
                assert!(
                    error.norm() < 0.08,
                    "{action:?}, joint {joint}: {}",
                    error.norm()
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    #[test]
    fn bones_have_the_lengths_of_the_subject_and_the_recorded_directions(
        number in 0_u64..50, other in 0_u64..50, seconds in -1.0..4.0_f64,
    ) {
        let (recording, _) = recorded(number, Action::Boxing, 20.0, 60);
        let (it, bones, _) = performed(&recording, other);
        let frames = it.frames(seconds);
        for bone in 0..N_BONES {
            if let Some(parent) = PARENT[bone] {
                let length = (frames[bone].translation.vector - frames[parent].translation.vector).norm();
                prop_assert!((length - bones.offset[bone].norm()).abs() < 1e-9);
            }
        }
        let (got, posture) = (bones.joints(&frames), recording.at(seconds));
        for [from, to] in [[2, 1], [1, 0], [3, 4], [4, 5], [8, 7], [7, 6], [9, 10], [10, 11]] {
            let recorded = Vector3::from(posture.joints[to]) - Vector3::from(posture.joints[from]);
            let angle = recorded.angle(&(got[to] - got[from]));
            prop_assert!(angle < 1e-6, "{} to {}: {}", from, to, angle);
        }
    }

    #[test]
    fn knees_and_elbows_turn_about_the_axis_of_their_bend(
        number in 0_u64..50, seconds in 0.0..3.0_f64,
    ) {
        let (recording, motion) = recorded(number, Action::Jogging, 50.0, 160);
        let (it, ..) = performed(&recording, number);
        let nth = (seconds * 50.0).round() / 50.0;
        let (got, expected) = (it.frames(nth), motion.bones.frames(&motion.pose(nth)));
        let forward = |frames: &[Isometry3<f64>; N_BONES], bone: usize| frames[bone].rotation * Vector3::x();
        for bone in [SHIN[LEFT], SHIN[RIGHT], FOREARM[LEFT], FOREARM[RIGHT], FOOT[LEFT], FOOT[RIGHT]] {
            let angle = forward(&got, bone).angle(&forward(&expected, bone));
            prop_assert!(angle.to_degrees() < 30.0, "bone {}: {}", bone, angle.to_degrees());
        }
    }
}

#[test]
fn the_pose_is_constant_before_the_beginning_and_after_the_end() {
    let (recording, _) = recorded(1, Action::Walking, 10.0, 11);
    assert!((recording.seconds() - 1.0).abs() < 1e-12);
    let (it, ..) = performed(&recording, 2);
    assert_eq!(it.frames(-3.0), it.frames(0.0));
    assert_eq!(it.frames(9.0), it.frames(1.0));
    assert_ne!(it.frames(0.0), it.frames(1.0));
}

#[test]
fn a_scaled_and_shifted_recording_gives_the_same_motion() {
    let (recording, _) = recorded(4, Action::Gestures, 20.0, 60);
    let mut far = recording.clone();
    for posture in &mut far.postures {
        let moved = |at: [f64; 3]| [3.0 * at[0] + 40.0, 3.0 * at[1] - 7.0, 3.0 * at[2] + 2.0];
        posture.joints = posture.joints.map(moved);
        posture.toes = posture.toes.map(|toe| toe.map(moved));
    }
    let (near, bones, height) = performed(&recording, 5);
    let (far, ..) = performed(&far, 5);
    let lowest = bones.lowest(&near.frames(1.0), height);
    assert!(lowest.abs() < 0.05, "{lowest}");
    for (a, b) in near.frames(1.0).iter().zip(far.frames(1.0)) {
        let error = a.translation.vector - b.translation.vector;
        assert!(error.norm() < 1e-9, "{error}");
        assert!(a.translation.vector.xy().norm() < 1.6);
    }
}

#[test]
fn coinciding_joints_give_finite_frames() {
    let nowhere = Recording {
        name: String::new(),
        rate_hz: 1.0,
        postures: vec![Posture {
            joints: [[0.0; 3]; N_JOINTS],
            toes: Some([[0.0; 3]; 2]),
        }],
    };
    let (it, ..) = performed(&nowhere, 1);
    for frame in it.frames(0.0) {
        assert!(frame.translation.vector.iter().all(|value| value.is_finite()));
        assert!(frame.rotation.coords.iter().all(|coord| coord.is_finite()));
    }
}
