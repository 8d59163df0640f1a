//! What keypoints are called, and how the joints of the skeleton follow from them.

use skeleton::PARSE14;

/// COCO's, as its annotations order them.
pub const COCO_17: [&str; 17] = [
    "nose",
    "left eye",
    "right eye",
    "left ear",
    "right ear",
    "left shoulder",
    "right shoulder",
    "left elbow",
    "right elbow",
    "left wrist",
    "right wrist",
    "left hip",
    "right hip",
    "left knee",
    "right knee",
    "left ankle",
    "right ankle",
];

/// Those of Halpe with feet (`AlphaPose`, RTMPose): COCO's, then nine more.
pub const HALPE_26: [&str; 26] = [
    "nose",
    "left eye",
    "right eye",
    "left ear",
    "right ear",
    "left shoulder",
    "right shoulder",
    "left elbow",
    "right elbow",
    "left wrist",
    "right wrist",
    "left hip",
    "right hip",
    "left knee",
    "right knee",
    "left ankle",
    "right ankle",
    "head top",
    "neck",
    "pelvis",
    "left big toe",
    "right big toe",
    "left small toe",
    "right small toe",
    "left heel",
    "right heel",
];

/// OpenPose's.
pub const BODY_25: [&str; 25] = [
    "nose",
    "neck",
    "right shoulder",
    "right elbow",
    "right wrist",
    "left shoulder",
    "left elbow",
    "left wrist",
    "pelvis",
    "right hip",
    "right knee",
    "right ankle",
    "left hip",
    "left knee",
    "left ankle",
    "right eye",
    "left eye",
    "right ear",
    "left ear",
    "left big toe",
    "left small toe",
    "left heel",
    "right big toe",
    "right small toe",
    "right heel",
];

/// Those of OpenPose's experimental model: COCO's, then those of MPII and of feet. Files do not tell them from [`BODY_25`].
pub const BODY_25B: [&str; 25] = [
    "nose",
    "left eye",
    "right eye",
    "left ear",
    "right ear",
    "left shoulder",
    "right shoulder",
    "left elbow",
    "right elbow",
    "left wrist",
    "right wrist",
    "left hip",
    "right hip",
    "left knee",
    "right knee",
    "left ankle",
    "right ankle",
    "neck",
    "head top",
    "left big toe",
    "left small toe",
    "left heel",
    "right big toe",
    "right small toe",
    "right heel",
];

/// OpenPose's older set, of networks that were trained on COCO.
pub const OPENPOSE_18: [&str; 18] = [
    "nose",
    "neck",
    "right shoulder",
    "right elbow",
    "right wrist",
    "left shoulder",
    "left elbow",
    "left wrist",
    "right hip",
    "right knee",
    "right ankle",
    "left hip",
    "left knee",
    "left ankle",
    "right eye",
    "left eye",
    "right ear",
    "left ear",
];

/// Those of MPII Human Pose.
pub const MPII_16: [&str; 16] = [
    "right ankle",
    "right knee",
    "right hip",
    "left hip",
    "left knee",
    "left ankle",
    "pelvis",
    "thorax",
    "neck",
    "head top",
    "right wrist",
    "right elbow",
    "right shoulder",
    "left shoulder",
    "left elbow",
    "left wrist",
];

/// Those of Leeds Sports Pose; the skeleton's own 14 joints.
pub const LSP_14: [&str; 14] = [
    "right ankle",
    "right knee",
    "right hip",
    "left hip",
    "left knee",
    "left ankle",
    "right wrist",
    "right elbow",
    "right shoulder",
    "left shoulder",
    "left elbow",
    "left wrist",
    "neck",
    "head top",
];

/// The sets that a card can name.
pub const SETS: [(&str, &[&str]); 7] = [
    ("coco-17", &COCO_17),
    ("halpe-26", &HALPE_26),
    ("body-25", &BODY_25),
    ("body-25b", &BODY_25B),
    ("openpose-18", &OPENPOSE_18),
    ("mpii-16", &MPII_16),
    ("lsp-14", &LSP_14),
];

/// From the neck to the top of the head, in lengths of the way from the neck to the middle of eyes and ears.
const HEAD_TOP: f64 = 1.6;

/// Every joint of `skeleton::PARSE14` as a weighted sum of keypoints: their numbers, and weights that sum to 1; `None` for a
/// joint that does not follow from them.
///
/// A keypoint of the joint's name is the joint. Without a neck it is the middle of the shoulders; without the top of the head it
/// lies beyond the middle of eyes and ears, as seen from the neck, by 0.6 of the way there.
pub fn joint_rows(names: &[String]) -> Vec<Option<Vec<(usize, f64)>>> {
    let find = |name: &str| names.iter().position(|it| it == name);
    let mean = |wanted: &[&str]| -> Option<Vec<(usize, f64)>> {
        let found: Option<Vec<usize>> = wanted.iter().map(|it| find(it)).collect();
        let share = 1.0 / wanted.len() as f64;
        Some(found?.into_iter().map(|it| (it, share)).collect())
    };
    let neck = || mean(&["neck"]).or_else(|| mean(&["left shoulder", "right shoulder"]));
    let head = || {
        let face = mean(&["left eye", "right eye", "left ear", "right ear"])?;
        let mut row: Vec<(usize, f64)> = face.iter().map(|it| (it.0, HEAD_TOP * it.1)).collect();
        row.extend(neck()?.iter().map(|it| (it.0, (1.0 - HEAD_TOP) * it.1)));
        Some(row)
    };
    let joint = |name: &str| match name {
        "neck" => neck(),
        "head" => mean(&["head top"]).or_else(head),
        name => mean(&[name]),
    };
    PARSE14.joints.iter().map(|it| joint(it.name)).collect()
}

/// Whether a keypoint is a joint of `skeleton::PARSE14` by its name; all others are extra keypoints.
pub fn is_joint(name: &str) -> bool {
    name == "head top" || PARSE14.joints.iter().any(|it| it.name == name)
}

/// The name on the other side of the body: `left heel` of `right heel`; `None` for a name without a side.
pub fn mirrored(name: &str) -> Option<String> {
    let other = |from: &str, to: &str| {
        let rest = name.strip_prefix(from)?;
        Some(format!("{to}{rest}"))
    };
    other("left", "right").or_else(|| other("right", "left"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owned(names: &[&str]) -> Vec<String> {
        names.iter().map(|&it| it.to_owned()).collect()
    }

    #[test]
    fn every_set_gives_every_joint_by_weights_that_sum_to_1() {
        for (set, names) in SETS {
            let rows = joint_rows(&owned(names));
            for (joint, row) in PARSE14.joints.iter().zip(rows) {
                let row = row.unwrap_or_else(|| panic!("{set}: {}", joint.name));
                let sum: f64 = row.iter().map(|it| it.1).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{set}: {}", joint.name);
            }
        }
    }

    #[test]
    fn names_of_a_set_differ_and_come_in_pairs() {
        for (set, names) in SETS {
            for (nth, name) in names.iter().enumerate() {
                assert!(!names[..nth].contains(name), "{set}: {name} twice");
                if let Some(rest) = name.strip_prefix("left ") {
                    let other = format!("right {rest}");
                    assert!(names.contains(&other.as_str()), "{set}: {other}");
                }
            }
        }
    }

    #[test]
    fn halpe_begins_as_coco_does_and_lsp_is_the_skeletons() {
        assert_eq!(HALPE_26[..17], COCO_17);
        let joints = PARSE14.joints.iter().map(|it| it.name);
        let same = joints.zip(LSP_14).filter(|(a, b)| a == b).count();
        assert_eq!(same, 13, "all but the name of the top of the head");
    }

    #[test]
    fn keypoints_that_are_no_joints_are_extra() {
        let extra = |names: &[&'static str]| -> Vec<&str> {
            let names = names.iter().copied();
            names.filter(|it| !is_joint(it)).collect()
        };
        assert_eq!(extra(&LSP_14), [""; 0]);
        assert_eq!(extra(&COCO_17), COCO_17[..5]);
        assert_eq!(extra(&HALPE_26)[5..], HALPE_26[19..]);
    }

    #[test]
    fn a_name_with_a_side_has_one_on_the_other() {
        assert_eq!(mirrored("left heel").as_deref(), Some("right heel"));
        assert_eq!(mirrored("right_hand_3").as_deref(), Some("left_hand_3"));
        assert_eq!(mirrored("nose"), None);
    }

    #[test]
    fn a_head_without_a_top_lies_beyond_the_face() {
        let rows = joint_rows(&owned(&COCO_17));
        // The face at height 1.6, the shoulders at 1.4.
        let height = |keypoint: usize| if keypoint < 5 { 1.6 } else { 1.4 };
        let head = rows[13].as_ref().unwrap();
        let top: f64 = head.iter().map(|it| it.1 * height(it.0)).sum();
        assert!((top - 1.72).abs() < 1e-12, "{top}");
    }

    #[test]
    fn a_joint_that_no_keypoint_tells_is_missing() {
        let rows = joint_rows(&owned(&["left hip", "nose"]));
        let known = PARSE14.joints.iter().zip(&rows).filter(|it| it.1.is_some());
        let known: Vec<&str> = known.map(|it| it.0.name).collect();
        assert_eq!(known, ["left hip"]);
    }
}
