//! The published models' 26 parts, derived from the 14 joints of PARSE and LSP.

use skeleton::{MIRROR, PARENT, PARSE14, PART_NAMES};

use super::{SkeletonSpec, SkeletonTable};

const THIRD: f64 = 1.0 / 3.0;
const TWO_THIRDS: f64 = 2.0 / 3.0;

/// For each joint, the joint on the other side, in the order of `skeleton::PARSE14`.
const JOINT_MIRROR: [usize; 14] = [5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13];

/// Joints and weights of each part. Source: Yang & Ramanan's release 1.3, `PARSE_data`.
const WEIGHTS: [&[(usize, f64)]; 26] = [
    &[(13, 1.0)],
    &[(12, 1.0)],
    &[(8, 1.0)],
    &[(8, 0.5), (7, 0.5)],
    &[(7, 1.0)],
    &[(7, 0.5), (6, 0.5)],
    &[(6, 1.0)],
    &[(8, TWO_THIRDS), (2, THIRD)],
    &[(8, THIRD), (2, TWO_THIRDS)],
    &[(2, 1.0)],
    &[(2, 0.5), (1, 0.5)],
    &[(1, 1.0)],
    &[(1, 0.5), (0, 0.5)],
    &[(0, 1.0)],
    &[(9, 1.0)],
    &[(9, 0.5), (10, 0.5)],
    &[(10, 1.0)],
    &[(10, 0.5), (11, 0.5)],
    &[(11, 1.0)],
    &[(9, TWO_THIRDS), (3, THIRD)],
    &[(9, THIRD), (3, TWO_THIRDS)],
    &[(3, 1.0)],
    &[(3, 0.5), (4, 0.5)],
    &[(4, 1.0)],
    &[(4, 0.5), (5, 0.5)],
    &[(5, 1.0)],
];

impl SkeletonTable {
    /// The 26 parts of the published models, derived from the 14 joints of PARSE and LSP.
    pub fn published() -> Self {
        Self(SkeletonSpec {
            names: PART_NAMES.map(str::to_owned).to_vec(),
            parent: PARENT.to_vec(),
            mirror: MIRROR.to_vec(),
            weights: WEIGHTS.map(<[_]>::to_vec).to_vec(),
            joint_names: PARSE14.joints.iter().map(|joint| joint.name.to_owned()).collect(),
            joint_mirror: JOINT_MIRROR.to_vec(),
        })
    }
}
