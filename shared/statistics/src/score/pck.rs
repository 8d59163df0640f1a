//! Percentage of correct keypoints in one image.

/// The reported groups of joints, with the joints (of `skeleton::PARSE14`) that are averaged. A group combines left and right, or the neck
/// and the top of the head, as in Yang & Ramanan's released `eval_pck`.
pub const PCK_GROUPS: [(&str, [usize; 2]); 7] = [
    ("head", [12, 13]),
    ("shoulder", [8, 9]),
    ("elbow", [7, 10]),
    ("wrist", [6, 11]),
    ("hip", [2, 3]),
    ("knee", [1, 4]),
    ("ankle", [0, 5]),
];

/// Returns which joints are found, that is, at most `share` of the person's size from the truth.
///
/// The size is the longer side of the rectangle around the true joints plus 1 px, since the pixels at both ends belong to it (Yang &
/// Ramanan 2013, section 6.2, and their released code). They use a `share` of 0.1 for PARSE and 0.2 for BUFFY. A joint that is NaN in
/// `found` is not found.
///
/// * `found`, `truth`: the same joints, in pixels.
pub fn joints_found<const N: usize>(
    found: &[[f64; 2]; N],
    truth: &[[f64; 2]; N],
    share: f64,
) -> [bool; N] {
    let side = |axis: usize| {
        let values = || truth.iter().map(move |truth| truth[axis]);
        values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
    };
    let limit = share * (side(0).max(side(1)) + 1.0);
    std::array::from_fn(|i| (found[i][0] - truth[i][0]).hypot(found[i][1] - truth[i][1]) <= limit)
}

/// Returns the best detection of the annotated person on an image where others may be detected as well.
///
/// This is the detection with the highest score among those whose box covers more than `share` of the annotated box. The released
/// evaluation uses a `share` of 0.3 for PCK, on detections before non-maximum suppression.
///
/// * `detections`: score and box `[x1, y1, x2, y2]` around all parts, in pixels.
/// * `truth`: the annotated box, in pixels.
/// * Returns the index of the detection; `None` if no detection covers enough.
pub fn best_covering(detections: &[(f64, [f64; 4])], truth: [f64; 4], share: f64) -> Option<usize> {
    let area =
        |bounds: [f64; 4]| (bounds[2] - bounds[0]).max(0.0) * (bounds[3] - bounds[1]).max(0.0);
    let common = |bounds: [f64; 4]| {
        [
            bounds[0].max(truth[0]),
            bounds[1].max(truth[1]),
            bounds[2].min(truth[2]),
            bounds[3].min(truth[3]),
        ]
    };
    let mut best: Option<usize> = None;
    for (index, &(score, place)) in detections.iter().enumerate() {
        let is_better = best.is_none_or(|i| score > detections[i].0);
        if area(common(place)) > share * area(truth) && is_better {
            best = Some(index);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_a_fraction_of_the_longer_side_plus_one_pixel() {
        let truth = [[0.0, 0.0], [10.0, 99.0]];
        let found = |off: f64| joints_found(&[[off, 0.0], [10.0, f64::NAN]], &truth, 0.1);
        assert_eq!(found(10.0), [true, false]);
        assert_eq!(found(10.001), [false, false]);
    }

    #[test]
    fn the_groups_contain_every_joint_once_and_both_sides_together() {
        let mut joints: Vec<usize> = PCK_GROUPS.iter().flat_map(|pck_group| pck_group.1).collect();
        joints.sort_unstable();
        assert_eq!(joints, (0..14).collect::<Vec<_>>());
        for (name, joints) in &PCK_GROUPS[1..] {
            let [a, b] = joints.map(|joint| skeleton::PARSE14.joints[joint].name);
            let mut names = [a, b];
            names.sort_unstable();
            assert_eq!(names, [format!("left {name}"), format!("right {name}")]);
        }
    }

    #[test]
    fn a_better_detection_elsewhere_is_ignored() {
        let truth = [0.0, 0.0, 10.0, 10.0];
        let detections = [
            (3.0, [20.0, 0.0, 30.0, 10.0]),
            (2.5, [0.0, 0.0, 10.0, 3.0]),
            (1.0, [0.0, 0.0, 10.0, 4.0]),
            (1.0, [0.0, 0.0, 10.0, 10.0]),
            (f64::NAN, [0.0, 0.0, 10.0, 10.0]),
        ];
        assert_eq!(best_covering(&detections, truth, 0.3), Some(2));
        assert_eq!(best_covering(&detections[..2], truth, 0.3), None);
        assert_eq!(best_covering(&[], truth, 0.3), None);
    }
}
