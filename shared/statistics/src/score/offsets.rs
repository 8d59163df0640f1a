//! Mean offsets of found joints along and across their bones, in fractions of the person's height.
//!
//! PCP and PCK count joints that are close enough to their annotated positions; they do not show a systematic offset. A bone points
//! outwards from the trunk to the joint at its end. *Along* is positive if the joint is found too far from the trunk: a knee that is found
//! too high on the thigh has a negative value. *Across* is positive away from the body if the limb hangs down: to the left in the picture
//! for right limbs, to the right for left ones.

use crate::score::{Bootstrap, Share};

/// Number of joints in `skeleton::PARSE14`.
const N_JOINTS: usize = 14;

/// Maximum distance of a found joint from its annotated position, as a fraction of the person's size; a joint farther away counts as not
/// found.
pub const FOUND_WITHIN: f64 = 0.2;

/// Start of the bone that ends at each joint: the mean of these joints.
const BONES: [&[usize]; N_JOINTS] = [
    &[1],
    &[2],
    &[12],
    &[12],
    &[3],
    &[4],
    &[7],
    &[8],
    &[12],
    &[12],
    &[9],
    &[10],
    &[2, 3],
    &[12],
];

/// Name and joints of every row, with the joints of both sides.
const ROWS: [(&str, &[usize]); 8] = [
    ("head", &[13]),
    ("neck", &[12]),
    ("shoulder", &[8, 9]),
    ("elbow", &[7, 10]),
    ("wrist", &[6, 11]),
    ("hip", &[2, 3]),
    ("knee", &[1, 4]),
    ("ankle", &[0, 5]),
];

/// The offsets of a joint, for both sides together, in percent of the person's height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offset {
    /// Name of the joint.
    pub joint: &'static str,
    /// Number of joints found.
    pub n_found: usize,
    /// Number of joints in total.
    pub n: usize,
    /// Mean offset along and across the bone.
    pub mean: [f64; 2],
    /// Confidence intervals of the means, by resampling people.
    pub interval: [[f64; 2]; 2],
}

/// Returns the mean offset of every joint.
///
/// * `people`: found and true joints of every person, in the order of `skeleton::PARSE14`.
/// * Returns one row per joint; joints that were never found have no row.
pub fn offsets<'a>(
    people: impl IntoIterator<Item = (Option<&'a [[f64; 2]; N_JOINTS]>, &'a [[f64; 2]; N_JOINTS])>,
    bootstrap: &Bootstrap,
) -> Vec<Offset> {
    let people: Vec<_> = people
        .into_iter()
        .map(|(found, truth)| found.map(|found| of_person(found, truth)))
        .collect();
    let row = |(joint, both): &(&'static str, &[usize])| {
        let shares = [0, 1].map(|axis| {
            let of_person = |person: &Option<[Option<[f64; 2]>; N_JOINTS]>| {
                let joints =
                    person.iter().flat_map(|offsets| both.iter().filter_map(|&at| offsets[at]));
                Share::of(joints.map(|joint| joint[axis]))
            };
            people.iter().map(of_person).collect::<Vec<_>>()
        });
        let [along, across] = shares.each_ref().map(|share| Share::mean(share));
        let [low, high] = shares.each_ref().map(|share| bootstrap.interval(share));
        Some(Offset {
            joint,
            n_found: shares[0].iter().map(|share| share.n as usize).sum(),
            n: people.len() * both.len(),
            mean: [along?, across?],
            interval: [low?, high?],
        })
    };
    ROWS.iter().filter_map(row).collect()
}

/// Returns the offsets of one person, along and across; `None` for joints that were not found.
fn of_person(
    found: &[[f64; 2]; N_JOINTS],
    truth: &[[f64; 2]; N_JOINTS],
) -> [Option<[f64; 2]>; N_JOINTS] {
    let is_found = crate::score::joints_found(found, truth, FOUND_WITHIN);
    let height = height(truth);
    std::array::from_fn(|joint| {
        let from = middle(truth, BONES[joint]);
        let [x, y] = [0, 1].map(|axis| truth[joint][axis] - from[axis]);
        let length = x.hypot(y);
        let is_bone = is_found[joint] && length > 0.0 && height > 0.0;
        is_bone.then(|| {
            let [u, v] = [0, 1].map(|axis| found[joint][axis] - truth[joint][axis]);
            // The joints 0 to 2 and 6 to 8 belong to the right side.
            let out = if matches!(joint, 0..=2 | 6..=8) {
                1.0
            } else {
                -1.0
            };
            let share = 100.0 / (length * height);
            [(u * x + v * y) * share, out * (v * x - u * y) * share]
        })
    })
}

/// Returns the standing height of a person, in the unit of the joints: from the top of the head via the neck to the hips, plus the longer
/// leg.
pub fn height<const D: usize>(joints: &[[f64; D]; N_JOINTS]) -> f64 {
    let distance = |a: [f64; D], b: [f64; D]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let length = |a: usize, b: usize| distance(joints[a], joints[b]);
    let legs =
        [(2, 1, 0), (3, 4, 5)].map(|(hip, knee, ankle)| length(hip, knee) + length(knee, ankle));
    let hips = middle(joints, &[2, 3]);
    length(13, 12) + distance(joints[12], hips) + legs[0].max(legs[1])
}

fn middle<const D: usize>(joints: &[[f64; D]; N_JOINTS], of: &[usize]) -> [f64; D] {
    std::array::from_fn(|axis| of.iter().map(|&i| joints[i][axis]).sum::<f64>() / of.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a person who stands with hanging arms, 100 px from the neck to the ankles and 20 px above the neck.
    fn person() -> [[f64; 2]; N_JOINTS] {
        [
            [40.0, 120.0],
            [40.0, 90.0],
            [40.0, 60.0],
            [60.0, 60.0],
            [60.0, 90.0],
            [60.0, 120.0],
            [30.0, 70.0],
            [30.0, 45.0],
            [30.0, 20.0],
            [70.0, 20.0],
            [70.0, 45.0],
            [70.0, 70.0],
            [50.0, 20.0],
            [50.0, 0.0],
        ]
    }

    fn offsets_after(move_it: impl Fn(&mut [[f64; 2]; N_JOINTS])) -> Vec<Offset> {
        let truth = person();
        let mut found = truth;
        move_it(&mut found);
        offsets(
            [(Some(&found), &truth), (None, &truth)],
            &Bootstrap::default(),
        )
    }

    #[test]
    fn a_knee_on_the_thigh_has_a_negative_offset_along_its_bone() {
        assert_eq!(height(&person()), 120.0);
        let rows = offsets_after(|joints| {
            for knee in [1, 4] {
                joints[knee][1] -= 6.0;
            }
        });
        let knee = rows.iter().find(|row| row.joint == "knee").unwrap();
        assert!((knee.mean[0] + 5.0).abs() < 1e-9 && knee.mean[1].abs() < 1e-9);
        assert_eq!((knee.n_found, knee.n), (2, 4));
        for it in rows.iter().filter(|row| row.joint != "knee") {
            assert_eq!(it.mean.map(f64::abs), [0.0; 2], "{}", it.joint);
        }
    }

    #[test]
    fn the_outward_direction_is_positive_on_both_sides() {
        let rows = offsets_after(|joints| {
            joints[0][0] -= 12.0;
            joints[5][0] += 12.0;
        });
        let ankle = rows.iter().find(|row| row.joint == "ankle").unwrap();
        assert!((ankle.mean[1] - 10.0).abs() < 1e-9 && ankle.mean[0].abs() < 1e-9);
    }

    #[test]
    fn a_joint_far_from_its_mark_was_not_found() {
        let rows = offsets_after(|joints| joints[6] = [300.0, 300.0]);
        let wrist = rows.iter().find(|row| row.joint == "wrist").unwrap();
        assert_eq!((wrist.n_found, wrist.mean), (1, [0.0; 2]));
    }
}
