//! Names of keypoints, and the rules that compute the joints of the skeleton from them.

use skeleton::PARSE14;

/// Keypoints of COCO, in the order of its annotations.
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

/// Big toe, small toe and heel of the left foot, then of the right foot.
const FEET: [&str; 6] = [
    "left big toe",
    "left small toe",
    "left heel",
    "right big toe",
    "right small toe",
    "right heel",
];

/// Appends a list of names to another.
const fn joined<const N: usize>(
    first: &[&'static str],
    second: &[&'static str],
) -> [&'static str; N] {
    assert!(first.len() + second.len() == N, "the number of names");
    let mut all = [""; N];
    let (head, tail) = all.split_at_mut(first.len());
    head.copy_from_slice(first);
    tail.copy_from_slice(second);
    all
}

/// Keypoints of Halpe with feet (`AlphaPose`, RTMPose): those of COCO, then nine more.
pub const HALPE_26: [&str; 26] = joined(
    &COCO_17,
    &[
        "head top",
        "neck",
        "pelvis",
        "left big toe",
        "right big toe",
        "left small toe",
        "right small toe",
        "left heel",
        "right heel",
    ],
);

/// Keypoints of `OpenPose`.
pub const BODY_25: [&str; 25] = joined(
    &[
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
    ],
    &FEET,
);

/// Keypoints of OpenPose's experimental model: those of COCO, then those of MPII and of feet. In files, they cannot be distinguished from
/// [`BODY_25`].
pub const BODY_25B: [&str; 25] = joined(&joined::<19>(&COCO_17, &["neck", "head top"]), &FEET);

/// Keypoints of OpenPose's older set, for networks that were trained on COCO.
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

/// Keypoints of MPII Human Pose.
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

/// Keypoints of Leeds Sports Pose; they are the 14 joints of the skeleton.
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

/// The first of the 133 keypoints of COCO-WholeBody: those of COCO and of the feet. The face and the hands follow them.
pub const COCO_FEET_23: [&str; 23] = joined(&COCO_17, &FEET);

/// Keypoint sets of files in which face and hands follow the body: name, the keypoints that are read, and the number of keypoints of a
/// person.
///
/// `coco-wholebody-133` is written by mmpose, `RTMLib` and `AlphaPose`, `halpe-136` by `AlphaPose`, and `body-135` by `OpenPose`.
pub const WHOLE_BODIES: [(&str, &[&str], usize); 3] = [
    ("coco-wholebody-133", &COCO_FEET_23, 133),
    ("halpe-136", &HALPE_26, 136),
    ("body-135", &BODY_25B, 135),
];

/// Distance from the neck to the top of the head, divided by the distance from the neck to the middle of eyes and ears.
const HEAD_TOP: f64 = 1.6;

/// A rule by which a joint is computed from keypoints.
#[derive(Debug, Clone, PartialEq)]
pub struct Way {
    /// Numbers of the keypoints, and weights that sum to 1.
    pub row: Vec<(usize, f64)>,
    /// Standard deviation along one axis that this rule adds to the standard deviation of its keypoints, as a fraction of the height of the
    /// person's box enlarged by a quarter.
    pub spread: f64,
}

/// Rules that compute the top of the head from a part of the face. Each has the keypoints, the ratio of two distances from the neck (that
/// of the top of the head, and that of the middle of the keypoints), and the spread.
///
/// The ratio for both ears and all spreads were measured with the keypoints of `body-25b`, which include the top of the head, on 421 people
/// in the demonstration of Pose2Sim. The rules are in the order of their spreads.
const FACES: [(&[&str], f64, f64); 8] = [
    (
        &["left eye", "right eye", "left ear", "right ear"],
        HEAD_TOP,
        0.0,
    ),
    (&["left ear", "right ear"], 1.8, 0.01),
    (&["left eye", "right eye"], HEAD_TOP, 0.035),
    (&["left ear"], HEAD_TOP, 0.05),
    (&["right ear"], HEAD_TOP, 0.05),
    (&["left eye"], HEAD_TOP, 0.05),
    (&["right eye"], HEAD_TOP, 0.05),
    (&["nose"], HEAD_TOP, 0.07),
];

/// Returns the rules that compute every joint of `skeleton::PARSE14` from keypoints, best first. A joint that cannot be computed from the
/// keypoints has no rules.
///
/// A keypoint with the joint's name is used as the joint (`head` or `head top` as the top of the head). The neck can also be computed as
/// the middle of the shoulders. The top of the head can also be computed from a part of the face: it lies on the line from the neck through
/// the middle of eyes and ears, at 1.6 times the distance to that middle.
pub fn joint_ways(names: &[String]) -> Vec<Vec<Way>> {
    let find = |name: &str| names.iter().position(|known| known == name);
    let mean = |wanted: &[&str]| -> Option<Vec<(usize, f64)>> {
        let found: Option<Vec<usize>> = wanted.iter().map(|name| find(name)).collect();
        let share = 1.0 / wanted.len() as f64;
        Some(found?.into_iter().map(|nth| (nth, share)).collect())
    };
    let way = |row| Way { row, spread: 0.0 };
    let necks = || [mean(&["neck"]), mean(&["left shoulder", "right shoulder"])];
    let heads = || {
        FACES.into_iter().flat_map(move |(face, length, spread)| {
            let beyond = move |neck: Vec<(usize, f64)>| {
                let mut row = mean(face)?;
                for term in &mut row {
                    term.1 *= length;
                }
                row.extend(neck.iter().map(|term| (term.0, (1.0 - length) * term.1)));
                Some(Way { row, spread })
            };
            necks().into_iter().flatten().filter_map(beyond)
        })
    };
    let ways = |name: &str| -> Vec<Way> {
        match name {
            "neck" => necks().into_iter().flatten().map(way).collect(),
            "head" => {
                let top = mean(&["head top"]).or_else(|| mean(&["head"]));
                top.map(way).into_iter().chain(heads()).collect()
            }
            name => mean(&[name]).map(way).into_iter().collect(),
        }
    };
    PARSE14.joints.iter().map(|joint| ways(joint.name)).collect()
}

/// Returns the best rule for every joint, the first of [`joint_ways`], as a weighted sum of keypoints; `None` for a joint that cannot be
/// computed from the keypoints.
pub fn joint_rows(names: &[String]) -> Vec<Option<Vec<(usize, f64)>>> {
    let ways = joint_ways(names).into_iter();
    ways.map(|ways| Some(ways.into_iter().next()?.row)).collect()
}

/// Returns true if the name of a keypoint is that of a joint of `skeleton::PARSE14`. All others are extra keypoints.
pub fn is_joint(name: &str) -> bool {
    name == "head top" || PARSE14.joints.iter().any(|joint| joint.name == name)
}

/// Returns the name on the other side of the body: `left heel` for `right heel`; `None` for a name without a side.
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
        names.iter().map(|&name| name.to_owned()).collect()
    }

    #[test]
    fn every_set_gives_every_joint_by_weights_that_sum_to_1() {
        for (set, names) in SETS {
            let rows = joint_rows(&owned(names));
            for (joint, row) in PARSE14.joints.iter().zip(rows) {
                let row = row.unwrap_or_else(|| panic!("{set}: {}", joint.name));
                let sum: f64 = row.iter().map(|row| row.1).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{set}: {}", joint.name);
            }
        }
    }

    #[test]
    fn names_of_a_set_are_unique_and_have_left_and_right_pairs() {
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
    fn halpe_begins_with_the_coco_keypoints_and_lsp_equals_the_skeleton() {
        assert_eq!(HALPE_26[..17], COCO_17);
        let joints = PARSE14.joints.iter().map(|joint| joint.name);
        let same = joints.zip(LSP_14).filter(|(a, b)| a == b).count();
        assert_eq!(same, 13, "all but the name of the top of the head");
    }

    #[test]
    fn keypoints_that_are_not_joints_are_extra_keypoints() {
        let extra = |names: &[&'static str]| -> Vec<&str> {
            let names = names.iter().copied();
            names.filter(|name| !is_joint(name)).collect()
        };
        assert_eq!(extra(&LSP_14), [""; 0]);
        assert_eq!(extra(&COCO_17), COCO_17[..5]);
        assert_eq!(extra(&HALPE_26)[5..], HALPE_26[19..]);
    }

    #[test]
    fn every_name_with_a_side_has_a_counterpart() {
        assert_eq!(mirrored("left heel").as_deref(), Some("right heel"));
        assert_eq!(mirrored("right_hand_3").as_deref(), Some("left_hand_3"));
        assert_eq!(mirrored("nose"), None);
    }

    #[test]
    fn without_a_head_top_keypoint_the_head_is_estimated_from_the_face() {
        let rows = joint_rows(&owned(&COCO_17));
        // The face is at height 1.6, and the shoulders are at 1.4.
        let height = |keypoint: usize| if keypoint < 5 { 1.6 } else { 1.4 };
        let head = rows[13].as_ref().unwrap();
        let top: f64 = head.iter().map(|head| head.1 * height(head.0)).sum();
        assert!((top - 1.72).abs() < 1e-12, "{top}");
    }

    #[test]
    fn a_head_estimated_from_one_ear_or_the_nose_has_a_larger_deviation() {
        let names = owned(&OPENPOSE_18);
        let ways = &joint_ways(&names)[13];
        let spread = |seen: &[&str]| {
            let is_seen = |way: &&Way| way.row.iter().all(|term| seen.contains(&&*names[term.0]));
            ways.iter().find(is_seen).map(|way| way.spread)
        };
        let all = spread(&["neck", "left eye", "right eye", "left ear", "right ear"]);
        let ear = spread(&["neck", "right ear", "nose"]);
        let nose = spread(&["left shoulder", "right shoulder", "nose"]);
        assert_eq!(all, Some(0.0));
        assert!(all < ear && ear < nose, "{all:?} {ear:?} {nose:?}");
        assert_eq!(
            spread(&["nose"]),
            None,
            "without a neck there is no direction"
        );
    }

    #[test]
    fn keypoints_with_the_names_of_the_skeleton_give_all_joints() {
        let names: Vec<&str> = PARSE14.joints.iter().map(|joint| joint.name).collect();
        let rows = joint_rows(&owned(&names));
        let expected: Vec<_> = (0..names.len()).map(|nth| Some(vec![(nth, 1.0)])).collect();
        assert_eq!(rows, expected);
    }

    #[test]
    fn a_joint_without_keypoints_is_missing() {
        let rows = joint_rows(&owned(&["left hip", "nose"]));
        let known = PARSE14.joints.iter().zip(&rows).filter(|joint| joint.1.is_some());
        let known: Vec<&str> = known.map(|joint| joint.0.name).collect();
        assert_eq!(known, ["left hip"]);
    }
}
