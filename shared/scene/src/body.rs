//! The anatomical skeleton: bones, joint limits and forward kinematics.
//!
//! The frame of the body has x forward, y to the person's left, and z up. With all angles at 0, the person
//! stands with hanging arms, and the frame of every bone has its origin at the bone's joint and the axes of the body.

mod limits;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

pub(crate) use limits::LIMITS;

/// Number of bones.
pub(crate) const N_BONES: usize = 19;

pub(crate) const PELVIS: usize = 0;
pub(crate) const ABDOMEN: usize = 1;
pub(crate) const CHEST: usize = 2;
pub(crate) const NECK: usize = 3;
pub(crate) const HEAD: usize = 4;
/// First bone of each arm, left first. The bones that follow it are the upper arm, the forearm and the hand.
pub(crate) const COLLAR: [usize; 2] = [5, 9];
pub(crate) const UPPER_ARM: [usize; 2] = [6, 10];
pub(crate) const FOREARM: [usize; 2] = [7, 11];
pub(crate) const HAND: [usize; 2] = [8, 12];
/// First bone of each leg, left first. The bones that follow it are the shin and the foot.
pub(crate) const THIGH: [usize; 2] = [13, 16];
pub(crate) const SHIN: [usize; 2] = [14, 17];
pub(crate) const FOOT: [usize; 2] = [15, 18];

/// Index of the left side in [`COLLAR`] and [`THIGH`].
pub(crate) const LEFT: usize = 0;
/// Index of the right side in [`COLLAR`] and [`THIGH`].
pub(crate) const RIGHT: usize = 1;

/// The parent of every bone; `None` for the pelvis.
pub(crate) const PARENT: [Option<usize>; N_BONES] = [
    None,
    Some(PELVIS),
    Some(ABDOMEN),
    Some(CHEST),
    Some(NECK),
    Some(CHEST),
    Some(5),
    Some(6),
    Some(7),
    Some(CHEST),
    Some(9),
    Some(10),
    Some(11),
    Some(PELVIS),
    Some(13),
    Some(14),
    Some(PELVIS),
    Some(16),
    Some(17),
];

/// Returns +1 for bones of the left side, -1 for bones of the right side, and 0 for bones in the middle.
pub(crate) fn side_of(bone: usize) -> f64 {
    match bone {
        5..=8 | 13..=15 => 1.0,
        9..=12 | 16..=18 => -1.0,
        _ => 0.0,
    }
}

/// Flexion, abduction and twist of every joint in degrees; the values of the root are ignored.
///
/// Positive flexion: the trunk, neck and head bend forward, arms and legs swing forward, elbows and knees bend, and toes rise. Positive
/// abduction: limbs move away from the middle, collar bones rise, and the trunk bends to the right. Positive twist: the front of a limb
/// turns outward, and the trunk turns left.
pub(crate) type Angles = [[f64; 3]; N_BONES];

/// Clamps angles to the limits of the joints.
pub(crate) fn clamped(angles: &Angles) -> Angles {
    core::array::from_fn(|bone| {
        core::array::from_fn(|axis| {
            let [low, high] = LIMITS[bone][axis];
            angles[bone][axis].clamp(low, high)
        })
    })
}

/// Position and direction of a person, and the rotations of the joints.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pose {
    /// Frame of the pelvis in the frame of the room.
    pub(crate) root: Isometry3<f64>,
    pub(crate) angles: Angles,
}

/// Lengths of a skeleton, in metres.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bones {
    /// Vector from the joint of the parent to the joint of the bone, in the parent's frame.
    pub(crate) offset: [Vector3<f64>; N_BONES],
    /// Top of the head in the frame of the head.
    pub(crate) head_top: Vector3<f64>,
    /// Tip of the toes and back of the heel on the sole, in the frame of the foot.
    pub(crate) sole: [Vector3<f64>; 2],
    /// Tip of the hand in its frame.
    pub(crate) fingertip: Vector3<f64>,
}

/// The individual body proportions of a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Proportions {
    /// Standing height, in metres.
    pub(crate) height: f64,
    /// Length of the legs and of the arms, and widths of shoulders and hips, relative to the mean.
    pub(crate) legs: f64,
    pub(crate) arms: f64,
    pub(crate) shoulders: f64,
    pub(crate) hips: f64,
}

impl Bones {
    /// Creates a skeleton with bone lengths as fractions of the height, after Drillis & Contini (1966), as reprinted in Winter,
    /// *Biomechanics and Motor Control of Human Movement*. The positions of the joints within the trunk were chosen by eye.
    pub(crate) fn new(of: &Proportions) -> Self {
        let h = of.height;
        let leg = of.legs;
        // The height stays the same, so longer legs mean a shorter trunk.
        let trunk = (0.818 - 0.53 * leg - 0.0) / (0.818 - 0.53);
        let v = |x: f64, y: f64, z: f64| Vector3::new(x, y, z) * h;
        let mut offset = [Vector3::zeros(); N_BONES];
        offset[ABDOMEN] = v(-0.012, 0.0, 0.055 * trunk);
        offset[CHEST] = v(0.004, 0.0, 0.10 * trunk);
        offset[NECK] = v(-0.006, 0.0, 0.142 * trunk);
        offset[HEAD] = v(0.012, 0.0, 0.075);
        for (i, side) in [1.0, -1.0].into_iter().enumerate() {
            offset[COLLAR[i]] = v(0.004, side * 0.018, 0.120 * trunk);
            offset[UPPER_ARM[i]] = v(-0.008, side * 0.088 * of.shoulders, 0.008);
            offset[FOREARM[i]] = v(0.0, 0.0, -0.176 * of.arms);
            offset[HAND[i]] = v(0.0, 0.0, -0.146 * of.arms);
            offset[THIGH[i]] = v(0.0, side * 0.051 * of.hips, 0.0);
            offset[SHIN[i]] = v(0.0, 0.0, -0.245 * leg);
            offset[FOOT[i]] = v(0.0, 0.0, -0.246 * leg);
        }
        Self {
            offset,
            head_top: v(0.006, 0.0, 0.095),
            sole: [v(0.108, 0.0, -0.039), v(-0.036, 0.0, -0.039)],
            fingertip: v(0.006, 0.0, -0.102 * of.arms),
        }
    }

    /// Returns the frames of all bones, in the frame of the pose.
    pub(crate) fn frames(&self, pose: &Pose) -> [Isometry3<f64>; N_BONES] {
        let mut frames = [pose.root; N_BONES];
        for bone in 1..N_BONES {
            let Some(parent) = PARENT[bone] else { continue };
            let turn = rotation(bone, pose.angles[bone]);
            let joint = Isometry3::from_parts(Translation3::from(self.offset[bone]), turn);
            frames[bone] = frames[parent] * joint;
        }
        frames
    }

    /// Returns the height of the lowest point of the body.
    ///
    /// * `height`: height of the person, in metres.
    pub(crate) fn lowest(&self, frames: &[Isometry3<f64>; N_BONES], height: f64) -> f64 {
        let scale = height / 1.75;
        let soles = FOOT
            .iter()
            .flat_map(|&foot| self.sole.map(|sole| (frames[foot] * Point3::from(sole)).z));
        // Radii of the body around the joints, in metres for a man of 1.75 m.
        let round = [(PELVIS, 0.105), (CHEST, 0.112), (HEAD, 0.09)].into_iter();
        let limbs = [
            (UPPER_ARM, 0.05),
            (FOREARM, 0.04),
            (HAND, 0.03),
            (SHIN, 0.055),
        ];
        let limbs = limbs.into_iter().flat_map(|(pair, r)| pair.map(|pair| (pair, r)));
        let joints = round.chain(limbs).map(|(bone, r)| frames[bone].translation.z - r * scale);
        soles.chain(joints).fold(f64::INFINITY, f64::min)
    }

    /// Returns the tip of the nose, the left and right heel, and the left and right big toe. They are placed as human annotators do: on the
    /// skin or shoe, at half the height of the toes.
    pub(crate) fn extras(&self, frames: &[Isometry3<f64>; N_BONES]) -> [Point3<f64>; N_EXTRAS] {
        let at = |bone: usize, place: Vector3<f64>| frames[bone] * Point3::from(place);
        let [toe, heel] = self.sole;
        let h = -heel.x / 0.036;
        let heel = heel + Vector3::new(0.0, 0.0, 0.015 * h);
        // The big toe is shifted towards the other foot.
        let toe = |aside: f64| toe + Vector3::new(-0.008, aside * 0.010, 0.013) * h;
        [
            at(HEAD, Vector3::new(0.068, 0.0, 0.008) * h),
            at(FOOT[LEFT], heel),
            at(FOOT[RIGHT], heel),
            at(FOOT[LEFT], toe(-1.0)),
            at(FOOT[RIGHT], toe(1.0)),
        ]
    }

    /// Returns the 14 joints of `skeleton::PARSE14`, in its order.
    pub(crate) fn joints(&self, frames: &[Isometry3<f64>; N_BONES]) -> [Point3<f64>; 14] {
        let joint = |bone: usize| Point3::from(frames[bone].translation.vector);

        [
            joint(FOOT[RIGHT]),
            joint(SHIN[RIGHT]),
            joint(THIGH[RIGHT]),
            joint(THIGH[LEFT]),
            joint(SHIN[LEFT]),
            joint(FOOT[LEFT]),
            joint(HAND[RIGHT]),
            joint(FOREARM[RIGHT]),
            joint(UPPER_ARM[RIGHT]),
            joint(UPPER_ARM[LEFT]),
            joint(FOREARM[LEFT]),
            joint(HAND[LEFT]),
            joint(NECK),
            frames[HEAD] * Point3::from(self.head_top),
        ]
    }
}

/// Number of extra keypoints: see [`Scene::extras`](crate::Scene::extras).
pub const N_EXTRAS: usize = 5;

/// Returns the rotation of a joint: twist about the bone first, then abduction, then flexion.
fn rotation(bone: usize, degrees: [f64; 3]) -> UnitQuaternion<f64> {
    let [flexion, abduction, twist] = degrees.map(f64::to_radians);
    let side = side_of(bone);
    let mirror = if side < 0.0 { -1.0 } else { 1.0 };
    // A positive rotation about y bends the trunk forward and a knee backward; the other joints swing forward with a
    // negative rotation.
    let forward = match bone {
        ABDOMEN | CHEST | NECK | HEAD | 14 | 17 => flexion,
        _ => -flexion,
    };
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), forward)
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), mirror * abduction)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), mirror * twist)
}

#[cfg(test)]
mod tests;
