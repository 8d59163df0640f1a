//! The 14 true joints that all joint sets have in common, and the true positions of the 26 parts.

use skeleton::{JointSet, MIRROR, N_PARTS, PARSE14};
use statistics::score::Point;

/// Returns the 14 joints of `skeleton::PARSE14` from the joints of another set.
///
/// * `None` for a joint that is unknown or that the set does not have.
pub fn parse14(set: &JointSet, joints: &[Option<Point>]) -> Vec<Option<Point>> {
    let joint = |parts: &[usize]| {
        let at = set.joints.iter().position(|joint| joint.parts == parts)?;
        joints[at]
    };
    PARSE14.joints.iter().map(|joint_of_set| joint(joint_of_set.parts)).collect()
}

/// Parts of the right side that lie between two joints: the part, the parts at both joints, and the weight of the second joint.
///
/// Source: the annotation of the published models (`PARSE_data`). The left side is a mirror image.
const BETWEEN: [(usize, usize, usize, f64); 6] = [
    (3, 2, 4, 0.5),
    (5, 4, 6, 0.5),
    (7, 2, 9, 1.0 / 3.0),
    (8, 2, 9, 2.0 / 3.0),
    (10, 9, 11, 0.5),
    (12, 11, 13, 0.5),
];

/// Returns the true positions of the 26 parts in an image, in pixels; NaN where a joint is unknown.
///
/// * `joints`: joints of `skeleton::PARSE14`.
fn parts(joints: &[[f64; 2]]) -> [[f64; 2]; N_PARTS] {
    let mut parts = [[f64::NAN; 2]; N_PARTS];
    for (joint, at) in PARSE14.joints.iter().zip(joints) {
        parts[joint.parts[0]] = *at;
    }
    for (part, from, to, share) in BETWEEN {
        for side in [|part: usize| part, |i: usize| MIRROR[i]] {
            let ends = [parts[side(from)], parts[side(to)]];
            parts[side(part)] = [0, 1].map(|i| ends[0][i] + share * (ends[1][i] - ends[0][i]));
        }
    }
    parts
}

/// Returns a tenth of the longer side of the rectangle around joints, in the unit of the joints.
pub fn tenth_of(joints: &[[f64; 2]]) -> f64 {
    let side = |axis: usize| {
        let values = joints.iter().map(|joint| joint[axis]);
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
            [low.min(it), high.max(it)]
        });
        high - low + 1.0
    };
    0.1 * side(0).max(side(1))
}

/// Returns the true error of every part in a pose, in tenths of the person's size. This size is the longer side of the rectangle around the
/// true joints.
///
/// [Adaptive selection](crate::evaluation::Terms::Adaptive) uses these errors if the truth replaces the network. With thresholds of 1, a
/// part is switched off if its error exceeds a tenth of the person's size. If the model may swap left and right (for a person seen from
/// behind), the assignment with the smaller errors is used.
///
/// * `centres`: centres of the 26 parts, in pixels.
/// * `joints`: the true joints of `skeleton::PARSE14`, in pixels of the same image.
/// * Returns `None` if a joint is unknown.
pub fn part_errors(
    centres: &[[f64; 2]],
    joints: &[[f64; 2]],
    may_be_exchanged: bool,
) -> Option<Vec<f32>> {
    let (errors, _) = part_errors_and_facing(centres, joints, may_be_exchanged)?;
    Some(errors)
}

/// Returns the errors like [`part_errors`], and true if left and right are swapped.
pub fn part_errors_and_facing(
    centres: &[[f64; 2]],
    joints: &[[f64; 2]],
    may_be_exchanged: bool,
) -> Option<(Vec<f32>, bool)> {
    if centres.len() != N_PARTS || joints.iter().flatten().any(|joint| !joint.is_finite()) {
        return None;
    }
    let truth = parts(joints);
    let tenth = tenth_of(joints);
    let errors = |exchanged: bool| -> Vec<f32> {
        let of = |part: usize| truth[if exchanged { MIRROR[part] } else { part }];
        let error = |(part, at): (usize, &[f64; 2])| {
            let truth = of(part);
            ((at[0] - truth[0]).hypot(at[1] - truth[1]) / tenth) as f32
        };
        centres.iter().enumerate().map(error).collect()
    };
    let plain = errors(false);
    if !may_be_exchanged {
        return Some((plain, false));
    }
    let other = errors(true);
    let sum = |values: &[f32]| values.iter().sum::<f32>();
    Some(if sum(&other) < sum(&plain) {
        (other, true)
    } else {
        (plain, false)
    })
}

/// Returns the size of a person: the longer side of the rectangle around the joints, in pixels.
pub fn size(joints: &[[f64; 2]]) -> f64 {
    let side = |axis: usize| {
        let values = joints.iter().map(|joint| joint[axis]);
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
            [low.min(it), high.max(it)]
        });
        high - low + 1.0
    };
    side(0).max(side(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Joints of a person who faces the camera, 200 px tall.
    fn standing() -> Vec<[f64; 2]> {
        let joint = |value: usize| {
            [
                40.0 + 3.0 * value as f64,
                200.0 - 200.0 * value as f64 / 13.0,
            ]
        };
        (0..14).map(joint).collect()
    }

    #[test]
    fn every_data_set_has_the_fourteen_joints() {
        for set in JointSet::ALL {
            let joints: Vec<Option<Point>> =
                (0..set.joints.len()).map(|i| Some([i as f64, 0.0, 0.0])).collect();
            assert!(
                parse14(set, &joints).iter().all(Option::is_some),
                "{}",
                set.name
            );
        }
    }

    #[test]
    fn every_part_has_a_position_and_joints_coincide_with_their_parts() {
        let joints = standing();
        let parts = parts(&joints);
        assert!(parts.iter().flatten().all(|part| part.is_finite()));
        assert_eq!(PARSE14.from_parts(&parts), joints);
        let [shoulder, hip] = [parts[14], parts[21]];
        let third = shoulder[1] + (hip[1] - shoulder[1]) / 3.0;
        assert!((parts[19][1] - third).abs() < 1e-9);
    }

    #[test]
    fn a_part_that_is_off_by_a_tenth_of_the_person_has_a_relative_error_of_one() {
        let joints = standing();
        let mut found = parts(&joints).to_vec();
        found[6][0] += 20.1;
        let got = part_errors(&found, &joints, false).unwrap();
        assert!((got[6] - 1.0).abs() < 1e-5, "{}", got[6]);
        assert_eq!(got.iter().filter(|value| **value > 0.0).count(), 1);
    }

    #[test]
    fn sides_are_swapped_if_that_is_allowed_and_fits_better() {
        let joints = standing();
        let truth = parts(&joints);
        let found: Vec<[f64; 2]> = (0..N_PARTS).map(|i| truth[MIRROR[i]]).collect();
        let off = |may: bool| part_errors(&found, &joints, may).unwrap();
        assert!(off(true).iter().all(|error| *error == 0.0));
        assert!(off(false).iter().any(|value| *value > 1.0));
    }

    #[test]
    fn unknown_joints_contribute_no_errors() {
        let mut joints = standing();
        let found = parts(&joints);
        joints[3] = [f64::NAN; 2];
        assert_eq!(part_errors(&found, &joints, true), None);
    }
}
