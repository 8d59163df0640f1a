//! Joint sets of the data sets; each joint is the mean of one or two part centres.

/// A joint of a data set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Joint {
    /// Name in the data set.
    pub name: &'static str,
    /// Indices of the parts, counted from 0; the mean of their centres is the joint.
    pub parts: &'static [usize],
}

/// The joints of a data set, and the limbs that connect them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JointSet {
    /// Name in configuration files.
    pub name: &'static str,
    /// The joints, in the data set's order.
    pub joints: &'static [Joint],
    /// Pairs of indices into `joints`.
    pub limbs: &'static [(usize, usize)],
}

impl JointSet {
    /// The three joint sets; the default comes first.
    pub const ALL: [&'static Self; 3] = [&PARSE14, &UMPM15, &HUMANEVA20];

    /// Returns the joint set with that name, if there is one.
    #[must_use]
    pub fn by_name(name: &str) -> Option<&'static Self> {
        Self::ALL.into_iter().find(|set| set.name == name)
    }

    /// Returns the joints of a pose, computed from the centres of its 26 parts.
    ///
    /// * `centres`: one value per part; any type that can be averaged (2D pixels, 3D metres).
    /// * Returns one value per joint.
    ///
    /// # Panics
    ///
    /// If there are fewer centres than the joints need.
    #[must_use]
    pub fn from_parts<const D: usize>(&self, centres: &[[f64; D]]) -> Vec<[f64; D]> {
        self.joints
            .iter()
            .map(|joint| {
                let mut mean = [0.0; D];
                for &part in joint.parts {
                    for (sum, value) in mean.iter_mut().zip(centres[part]) {
                        *sum += value;
                    }
                }
                mean.map(|sum| sum / joint.parts.len() as f64)
            })
            .collect()
    }
}

/// A linear map from parts to joints, learned from people with known joints.
#[derive(Debug, Clone, PartialEq)]
pub struct JointMap {
    weights: Vec<Vec<f64>>,
}

impl JointMap {
    /// Creates the map from one row of weights per joint, with one weight per part; each row sums to 1.
    ///
    /// * Returns `None` if there are no rows, or if their lengths differ.
    #[must_use]
    pub fn new(weights: Vec<Vec<f64>>) -> Option<Self> {
        let n_parts = weights.first()?.len();
        let fits = weights.iter().all(|row| row.len() == n_parts);
        fits.then_some(Self { weights })
    }

    /// Returns the joints of a pose, computed from the centres of its parts.
    ///
    /// * `centres`: one value per part; any type that can be averaged (2D pixels, 3D metres).
    #[must_use]
    pub fn from_parts<const D: usize>(&self, centres: &[[f64; D]]) -> Vec<[f64; D]> {
        let joint = |row: &Vec<f64>| {
            let mut sum = [0.0; D];
            for (weight, centre) in row.iter().zip(centres) {
                for (sum, value) in sum.iter_mut().zip(centre) {
                    *sum += weight * value;
                }
            }
            sum
        };
        self.weights.iter().map(joint).collect()
    }
}

const fn joint(name: &'static str, parts: &'static [usize]) -> Joint {
    Joint { name, parts }
}

/// The 14 joints of PARSE and LSP (Yang & Ramanan's `PARSE_transback`).
pub static PARSE14: JointSet = JointSet {
    name: "parse14",
    joints: &[
        joint("right ankle", &[13]),
        joint("right knee", &[11]),
        joint("right hip", &[9]),
        joint("left hip", &[21]),
        joint("left knee", &[23]),
        joint("left ankle", &[25]),
        joint("right wrist", &[6]),
        joint("right elbow", &[4]),
        joint("right shoulder", &[2]),
        joint("left shoulder", &[14]),
        joint("left elbow", &[16]),
        joint("left wrist", &[18]),
        joint("neck", &[1]),
        joint("head", &[0]),
    ],
    limbs: &[
        (0, 1),
        (1, 2),
        (2, 12),
        (5, 4),
        (4, 3),
        (3, 12),
        (2, 3),
        (6, 7),
        (7, 8),
        (8, 12),
        (11, 10),
        (10, 9),
        (9, 12),
        (12, 13),
    ],
};

/// Pairs of joints of [`PARSE14`]: each joint of the right side with the same joint of the left side.
pub const SIDES: [[usize; 2]; 6] = [[0, 5], [1, 4], [2, 3], [6, 11], [7, 10], [8, 9]];

/// The same joint of [`PARSE14`] on the other side; a joint in the middle maps to itself.
pub const MIRRORED: [usize; crate::body::N_JOINTS] = {
    let mut mirror = [0; crate::body::N_JOINTS];
    let mut joint = 0;
    while joint < mirror.len() {
        mirror[joint] = joint;
        joint += 1;
    }
    let mut side = 0;
    while side < SIDES.len() {
        let [right, left] = SIDES[side];
        (mirror[right], mirror[left]) = (left, right);
        side += 1;
    }
    mirror
};

/// The 15 joints of UMPM; the pelvis is the midpoint of the hips.
pub static UMPM15: JointSet = JointSet {
    name: "umpm15",
    joints: &[
        joint("pelvis", &[9, 21]),
        joint("thorax", &[1]),
        joint("head", &[0]),
        joint("right shoulder", &[2]),
        joint("right elbow", &[4]),
        joint("right wrist", &[6]),
        joint("left shoulder", &[14]),
        joint("left elbow", &[16]),
        joint("left wrist", &[18]),
        joint("right hip", &[9]),
        joint("left hip", &[21]),
        joint("right knee", &[11]),
        joint("left knee", &[23]),
        joint("right ankle", &[13]),
        joint("left ankle", &[25]),
    ],
    limbs: &[
        (0, 1),
        (1, 2),
        (1, 3),
        (3, 4),
        (4, 5),
        (1, 6),
        (6, 7),
        (7, 8),
        (0, 9),
        (0, 10),
        (9, 11),
        (10, 12),
        (11, 13),
        (12, 14),
    ],
};

/// The 20 joint ends of `HumanEva`; each elbow and knee appears twice, as an end of two limbs.
pub static HUMANEVA20: JointSet = JointSet {
    name: "humaneva20",
    joints: &[
        joint("torsoProximal", &[1]),
        joint("torsoDistal", &[9, 21]),
        joint("upperLArmProximal", &[14]),
        joint("upperLArmDistal", &[16]),
        joint("lowerLArmProximal", &[16]),
        joint("lowerLArmDistal", &[18]),
        joint("upperRArmProximal", &[2]),
        joint("upperRArmDistal", &[4]),
        joint("lowerRArmProximal", &[4]),
        joint("lowerRArmDistal", &[6]),
        joint("upperLLegProximal", &[21]),
        joint("upperLLegDistal", &[23]),
        joint("lowerLLegProximal", &[23]),
        joint("lowerLLegDistal", &[25]),
        joint("upperRLegProximal", &[9]),
        joint("upperRLegDistal", &[11]),
        joint("lowerRLegProximal", &[11]),
        joint("lowerRLegDistal", &[13]),
        joint("headProximal", &[1]),
        joint("headDistal", &[0]),
    ],
    limbs: &[
        (0, 1),
        (2, 3),
        (4, 5),
        (6, 7),
        (8, 9),
        (10, 11),
        (12, 13),
        (14, 15),
        (16, 17),
        (18, 19),
    ],
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MIRROR, N_PARTS, PART_NAMES};

    #[test]
    fn joints_of_the_right_side_are_computed_from_parts_of_the_right_side() {
        for set in [&PARSE14, &UMPM15] {
            for joint in set.joints {
                for &part in joint.parts {
                    for side in ["right", "left"] {
                        if joint.name.starts_with(side) {
                            assert!(PART_NAMES[part].starts_with(side), "{}", joint.name);
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn the_pelvis_is_the_middle_of_the_hips() {
        let mut centres = [[0.0; 2]; N_PARTS];
        centres[9] = [10.0, 4.0];
        centres[21] = [20.0, 8.0];
        assert_eq!(UMPM15.from_parts(&centres)[0], [15.0, 6.0]);
    }

    #[test]
    fn limbs_name_joints_that_exist() {
        for set in JointSet::ALL {
            for &(a, b) in set.limbs {
                assert!(a < set.joints.len() && b < set.joints.len() && a != b);
            }
        }
    }

    #[test]
    fn every_joint_set_is_closed_under_the_mirror() {
        for set in JointSet::ALL {
            for joint in set.joints {
                let mut mirrored: Vec<usize> =
                    joint.parts.iter().map(|&part| MIRROR[part]).collect();
                mirrored.sort_unstable();
                assert!(
                    set.joints.iter().any(|joint| joint.parts == mirrored),
                    "{}",
                    joint.name
                );
            }
        }
    }
}
