//! Maximum distance between two joints if the joints between them are missing.

use crate::body::bone::{
    BONES, L_ELBOW, L_HIP, L_KNEE, L_SHOULDER, NECK, R_ELBOW, R_HIP, R_KNEE, R_SHOULDER, joints_of,
};
use crate::body::proportion::Kind;
use crate::body::{Joints, N_JOINTS};

/// For each joint, the next joint towards the neck and the kind of bone between them. For a hip, half the width of the hips is added.
const TOWARDS_NECK: [Option<(usize, Kind)>; N_JOINTS] = [
    Some((R_KNEE, Kind::LowerLeg)),
    Some((R_HIP, Kind::UpperLeg)),
    Some((NECK, Kind::Trunk)),
    Some((NECK, Kind::Trunk)),
    Some((L_HIP, Kind::UpperLeg)),
    Some((L_KNEE, Kind::LowerLeg)),
    Some((R_ELBOW, Kind::LowerArm)),
    Some((R_SHOULDER, Kind::UpperArm)),
    Some((NECK, Kind::ShoulderToNeck)),
    Some((NECK, Kind::ShoulderToNeck)),
    Some((L_SHOULDER, Kind::UpperArm)),
    Some((L_ELBOW, Kind::LowerArm)),
    None,
    Some((NECK, Kind::Head)),
];

/// Rank of a joint by its distance from the trunk: from 0 for the neck to 3 for ankles, wrists and the top of the head.
pub(crate) const RANK: [u32; N_JOINTS] = [3, 2, 1, 1, 2, 3, 3, 2, 1, 1, 2, 3, 0, 3];

/// Returns the sum of the lengths of the bones from one joint to another, in metres.
///
/// * `length`: function that returns the length of a kind of bone, in metres.
pub(crate) fn between(a: usize, b: usize, length: impl Fn(Kind) -> f64) -> f64 {
    let mut ends = [a, b];
    let mut sum = 0.0;
    while ends[0] != ends[1] {
        let is_hip = |joint: usize| joint == R_HIP || joint == L_HIP;
        if is_hip(ends[0]) && is_hip(ends[1]) {
            return sum + length(Kind::HipWidth);
        }
        // The end that is farther from the neck moves; if one end is on a leg and the other on an arm, both move in turn.
        let far = usize::from(RANK[ends[1]] > RANK[ends[0]]);
        let Some((next, kind)) = TOWARDS_NECK[ends[far]] else {
            return sum;
        };
        sum += length(kind);
        if kind == Kind::Trunk {
            sum += 0.5 * length(Kind::HipWidth);
        }
        ends[far] = next;
    }
    sum
}

/// For each joint `i`, the joints connected to it by present bones: bit `j` of entry `i`.
pub(crate) fn pieces(joints: &Joints) -> [u32; N_JOINTS] {
    let mut pieces: [u32; N_JOINTS] = core::array::from_fn(|joint| 1 << joint);
    for bone in BONES.iter().filter(|bone| bone.length(joints).is_some()) {
        let mask = joints_of(bone.mask()).fold(0, |mask, joint| mask | pieces[joint]);
        for joint in joints_of(mask) {
            pieces[joint] = mask;
        }
    }
    pieces
}

#[cfg(test)]
mod tests;
