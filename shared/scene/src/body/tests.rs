//! Tests of bone lengths, sides and directions of rotation.

use proptest::prelude::*;

use super::*;

fn bones() -> Bones {
    Bones::new(&Proportions {
        height: 1.75,
        legs: 1.0,
        arms: 1.0,
        shoulders: 1.0,
        hips: 1.0,
    })
}

fn standing() -> Pose {
    Pose {
        root: Isometry3::identity(),
        angles: [[0.0; 3]; N_BONES],
    }
}

fn bent(bone: usize, degrees: [f64; 3]) -> [Isometry3<f64>; N_BONES] {
    let mut pose = standing();
    pose.angles[bone] = degrees;
    bones().frames(&pose)
}

#[test]
fn a_standing_person_has_the_requested_height() {
    let bones = bones();
    let frames = bones.frames(&standing());
    let top = (frames[HEAD] * Point3::from(bones.head_top)).z;
    let sole = (frames[FOOT[LEFT]] * Point3::from(bones.sole[0])).z;
    assert!((top - sole - 1.75).abs() < 0.03, "{}", top - sole);
}

#[test]
fn left_joints_are_on_the_left() {
    let joints = bones().joints(&bones().frames(&standing()));
    let names = skeleton::PARSE14.joints.iter().map(|joint| joint.name);
    for (name, joint) in names.zip(joints) {
        let side = match name.split(' ').next() {
            Some("left") => 1.0,
            Some("right") => -1.0,
            _ => 0.0,
        };
        assert_eq!(joint.y.signum() * f64::from(joint.y != 0.0), side, "{name}");
    }
}

#[test]
fn heels_are_behind_the_ankles_and_big_toes_in_front_on_the_inner_side() {
    let frames = bones().frames(&standing());
    let [nose, heels @ .., left_toe, right_toe] = bones().extras(&frames);
    let top = frames[HEAD] * Point3::from(bones().head_top);
    assert!(nose.x > top.x + 0.05 && nose.z < top.z - 0.1);
    for (side, (heel, toe)) in heels.into_iter().zip([left_toe, right_toe]).enumerate() {
        let ankle = frames[FOOT[side]].translation.vector;
        assert!(heel.x < ankle.x - 0.05 && toe.x > ankle.x + 0.15);
        assert!(heel.z < ankle.z - 0.03 && toe.z < ankle.z - 0.03);
        assert!(toe.y.abs() < ankle.y.abs() && toe.y.signum() == ankle.y.signum());
    }
}

#[test]
fn positive_angles_turn_joints_in_the_documented_direction() {
    for side in [LEFT, RIGHT] {
        let out = [1.0, -1.0][side];
        let place =
            |frames: &[Isometry3<f64>; N_BONES], bone: usize| frames[bone].translation.vector;
        let raised = bent(UPPER_ARM[side], [90.0, 0.0, 0.0]);
        assert!(place(&raised, FOREARM[side]).x > 0.25, "forward");
        let raised = bent(UPPER_ARM[side], [0.0, 90.0, 0.0]);
        assert!(place(&raised, FOREARM[side]).y * out > 0.4, "sideward");
        let folded = bent(FOREARM[side], [90.0, 0.0, 0.0]);
        assert!(place(&folded, HAND[side]).x > 0.2, "elbows fold forward");
        let folded = bent(SHIN[side], [90.0, 0.0, 0.0]);
        assert!(place(&folded, FOOT[side]).x < -0.4, "knees fold backward");
        let swung = bent(THIGH[side], [0.0, 30.0, 0.0]);
        assert!(place(&swung, SHIN[side]).y * out > 0.2, "legs spread");
        let up = bent(FOOT[side], [20.0, 0.0, 0.0]);
        let toe = up[FOOT[side]] * Point3::from(bones().sole[0]);
        let flat = bones().frames(&standing())[FOOT[side]] * Point3::from(bones().sole[0]);
        assert!(toe.z > flat.z + 0.05, "toes rise");
        let lifted = bent(COLLAR[side], [0.0, 20.0, 0.0]);
        let level = bones().frames(&standing());
        assert!(place(&lifted, UPPER_ARM[side]).z > place(&level, UPPER_ARM[side]).z + 0.02);
    }
    let nod = bent(ABDOMEN, [40.0, 0.0, 0.0]);
    assert!(
        nod[HEAD].translation.vector.x > 0.2,
        "the trunk bends forward"
    );
}

proptest! {
    #[test]
    fn lengths_do_not_depend_on_the_pose(
        angles in prop::array::uniform19(prop::array::uniform3(-180.0..180.0_f64)),
        x in -3.0..3.0, turn in -3.0..3.0,
    ) {
        let bones = bones();
        let root = Isometry3::new(Vector3::new(x, 0.5, 1.0), Vector3::new(0.1, turn, 0.3));
        let pose = Pose { root, angles: clamped(&angles) };
        let frames = bones.frames(&pose);
        for (bone, limits) in LIMITS.iter().enumerate() {
            for (axis, [low, high]) in limits.iter().enumerate() {
                prop_assert!((*low..=*high).contains(&pose.angles[bone][axis]));
            }
            if let Some(parent) = PARENT[bone] {
                let length = (frames[bone].translation.vector - frames[parent].translation.vector).norm();
                prop_assert!((length - bones.offset[bone].norm()).abs() < 1e-9);
            }
        }
    }
}
