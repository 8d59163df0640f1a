//! The bones between the joints of `crate::PARSE14`.

use nalgebra::{Point3, Vector3};

use crate::body::Joints;
use crate::body::proportion::Kind;

/// Number of bones.
pub const N_BONES: usize = 14;

pub(crate) const R_ANKLE: usize = 0;
pub(crate) const R_KNEE: usize = 1;
pub(crate) const R_HIP: usize = 2;
pub(crate) const L_HIP: usize = 3;
pub(crate) const L_KNEE: usize = 4;
pub(crate) const L_ANKLE: usize = 5;
pub(crate) const R_WRIST: usize = 6;
pub(crate) const R_ELBOW: usize = 7;
pub(crate) const R_SHOULDER: usize = 8;
pub(crate) const L_SHOULDER: usize = 9;
pub(crate) const L_ELBOW: usize = 10;
pub(crate) const L_WRIST: usize = 11;
pub(crate) const NECK: usize = 12;
pub(crate) const HEAD: usize = 13;

/// The distance between two joints, or between the midpoint of two joints and a third.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bone {
    /// Name of the bone.
    pub name: &'static str,
    /// Kind of the bone.
    pub kind: Kind,
    /// Start of the bone: the midpoint of these two joints. Except for the trunk, both are the same joint.
    pub from: [usize; 2],
    /// The joint at the end of the bone.
    pub to: usize,
}

const fn bone(name: &'static str, kind: Kind, from: [usize; 2], to: usize) -> Bone {
    Bone {
        name,
        kind,
        from,
        to,
    }
}

/// All bones, in a fixed order.
pub const BONES: [Bone; N_BONES] = [
    bone("right lower leg", Kind::LowerLeg, [R_KNEE; 2], R_ANKLE),
    bone("right upper leg", Kind::UpperLeg, [R_HIP; 2], R_KNEE),
    bone("hip width", Kind::HipWidth, [R_HIP; 2], L_HIP),
    bone("left upper leg", Kind::UpperLeg, [L_HIP; 2], L_KNEE),
    bone("left lower leg", Kind::LowerLeg, [L_KNEE; 2], L_ANKLE),
    bone("right lower arm", Kind::LowerArm, [R_ELBOW; 2], R_WRIST),
    bone("right upper arm", Kind::UpperArm, [R_SHOULDER; 2], R_ELBOW),
    bone("left upper arm", Kind::UpperArm, [L_SHOULDER; 2], L_ELBOW),
    bone("left lower arm", Kind::LowerArm, [L_ELBOW; 2], L_WRIST),
    bone(
        "right shoulder to neck",
        Kind::ShoulderToNeck,
        [NECK; 2],
        R_SHOULDER,
    ),
    bone(
        "left shoulder to neck",
        Kind::ShoulderToNeck,
        [NECK; 2],
        L_SHOULDER,
    ),
    bone(
        "shoulder width",
        Kind::ShoulderWidth,
        [R_SHOULDER; 2],
        L_SHOULDER,
    ),
    bone("trunk", Kind::Trunk, [R_HIP, L_HIP], NECK),
    bone("head", Kind::Head, [NECK; 2], HEAD),
];

/// Pairs of bones: each bone of the right side with the same bone of the left side.
pub(crate) const SIDES: [[usize; 2]; 5] = [[0, 4], [1, 3], [5, 8], [6, 7], [9, 10]];

impl Bone {
    /// Returns the vector from the start of the bone to its end, in metres in the world; `None` if a joint is missing.
    pub(crate) fn vector(&self, joints: &Joints) -> Option<Vector3<f64>> {
        let [a, b] = self.from;
        let from = nalgebra::center(&joints[a]?, &joints[b]?);
        Some(joints[self.to]? - from)
    }

    /// Returns the length of the bone, in metres; `None` if a joint is missing.
    pub fn length(&self, joints: &Joints) -> Option<f64> {
        self.vector(joints).map(|vector| vector.norm())
    }

    /// Bit mask of the bone's joints: bit `i` is set if joint `i` is an end.
    pub(crate) const fn mask(&self) -> u32 {
        1 << self.from[0] | 1 << self.from[1] | 1 << self.to
    }
}

/// Returns the lengths of all bones, in metres; `None` if a joint is missing.
pub(crate) fn lengths(joints: &Joints) -> [Option<f64>; N_BONES] {
    core::array::from_fn(|i| BONES[i].length(joints))
}

/// Replaces unusable joints with `None`.
pub(crate) fn clean(joints: &Joints) -> Joints {
    const FARTHEST: f64 = 1e6;
    let is_near = |point: &Point3<f64>| point.iter().all(|x| x.abs() < FARTHEST);
    joints.map(|joint| joint.filter(is_near))
}

/// Returns the joints in a bit mask, in ascending order.
pub(crate) fn joints_of(mut mask: u32) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let joint = mask.trailing_zeros();
        mask &= mask.wrapping_sub(1);
        (joint < u32::BITS).then_some(joint as usize)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::N_JOINTS;

    #[test]
    fn bones_connect_the_joints_in_their_names() {
        let joints = crate::PARSE14.joints;
        assert_eq!(joints.len(), N_JOINTS);
        assert_eq!(joints[NECK].name, "neck");
        assert_eq!(joints[HEAD].name, "head");
        for bone in &BONES {
            for side in ["right", "left"] {
                if bone.name.starts_with(side) {
                    let names = joints_of(bone.mask()).map(|joint| joints[joint].name);
                    assert!(names.into_iter().all(|name| name.starts_with(side) || name == "neck"));
                }
            }
        }
        let ends =
            |i: usize| joints_of(BONES[i].mask()).map(|i| joints[i].name).collect::<Vec<_>>();
        assert_eq!(ends(0), ["right ankle", "right knee"]);
        assert_eq!(ends(8), ["left elbow", "left wrist"]);
        assert_eq!(ends(12), ["right hip", "left hip", "neck"]);
    }

    #[test]
    fn left_and_right_bones_are_pairs_of_the_same_kind() {
        for [right, left] in SIDES {
            assert_eq!(BONES[right].kind, BONES[left].kind);
            assert_eq!(BONES[right].name.replace("right", "left"), BONES[left].name);
        }
    }

    #[test]
    fn joints_that_are_not_finite_count_as_missing() {
        let mut joints = [Some(Point3::origin()); N_JOINTS];
        joints[3] = Some(Point3::new(f64::NAN, 0.0, 0.0));
        joints[4] = Some(Point3::new(0.0, f64::INFINITY, 0.0));
        joints[5] = Some(Point3::new(0.0, 1e300, 0.0));
        let missing: Vec<usize> = (0..N_JOINTS).filter(|i| clean(&joints)[*i].is_none()).collect();
        assert_eq!(missing, [3, 4, 5]);
    }
}
