//! Definitions of all angles: names, joints, formulas.

use core::fmt;

use nalgebra::{UnitVector3, Vector3};

use super::body::{axes_right, axes_up, between, direction};
use super::{LEAST_BEND, LEAST_TILT, SIDES};
use crate::role::{Role, Side};

/// An angle of a body. The axes of pelvis and thorax are x forwards, y upwards, z to the right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Angle {
    /// Forward angle of the trunk (midpoint of the hips to the neck) from the vertical, in the direction that the hips face.
    TrunkForwards,
    /// Angle of the trunk from the vertical towards the person's right.
    TrunkSideways,
    /// Rotation of the shoulder line about the trunk relative to the hip line, positive to the left (right shoulder forwards).
    TrunkRotation,
    /// Angle of the trunk from the plane perpendicular to the hip line; positive if bent towards the right.
    TrunkBend,
    /// Forward rotation of the thigh about the hip line.
    HipFlexion(Side),
    /// Outward angle of the thigh from the plane of flexion.
    HipAbduction(Side),
    /// Inward rotation of the knee's bending axis about the thigh.
    HipRotation(Side),
    /// Angle between thigh and lower leg, 0 if straight.
    KneeFlexion(Side),
    /// Upward angle of the foot (heel to toe) from the perpendicular of the lower leg.
    AnkleDorsiflexion(Side),
    /// Angle between the upper arm and the trunk's downward direction.
    ShoulderElevation(Side),
    /// Plane of elevation: 0 sideways (abduction), 90 forwards (flexion).
    ShoulderPlane(Side),
    /// Inward rotation of the elbow's bending axis about the upper arm, relative to its position after the first two rotations. It is 0 for
    /// an arm held out sideways with the forearm forwards. For hanging arms, neither the plane of elevation nor this angle is defined.
    ShoulderRotation(Side),
    /// Angle between upper arm and forearm, 0 if straight.
    ElbowFlexion(Side),
}

impl Angle {
    /// Returns all angles, in the order used in files.
    pub fn all() -> Vec<Self> {
        let trunk = [
            Self::TrunkForwards,
            Self::TrunkSideways,
            Self::TrunkRotation,
            Self::TrunkBend,
        ];
        let of_side = |side: Side| {
            [
                Self::HipFlexion(side),
                Self::HipAbduction(side),
                Self::HipRotation(side),
                Self::KneeFlexion(side),
                Self::AnkleDorsiflexion(side),
                Self::ShoulderElevation(side),
                Self::ShoulderPlane(side),
                Self::ShoulderRotation(side),
                Self::ElbowFlexion(side),
            ]
        };
        trunk.into_iter().chain(SIDES.into_iter().flat_map(of_side)).collect()
    }

    /// Returns true if the angle is measured from the vertical.
    pub fn needs_up(self) -> bool {
        matches!(self, Self::TrunkForwards | Self::TrunkSideways)
    }

    /// Returns the joints that define the angle, in the order expected by `degrees`.
    pub fn roles(self) -> Vec<Role> {
        use Role::{Ankle, BigToe, Elbow, Heel, Hip, Knee, Neck, Shoulder, Wrist};
        use Side::{Left, Right};
        let hips = [Hip(Right), Hip(Left), Neck];
        let all = |more: &[Role]| hips.iter().chain(more).copied().collect();
        match self {
            Self::TrunkForwards | Self::TrunkSideways | Self::TrunkBend => all(&[]),
            Self::TrunkRotation => all(&[Shoulder(Right), Shoulder(Left)]),
            Self::HipFlexion(it) | Self::HipAbduction(it) => {
                vec![Hip(Right), Hip(Left), Neck, Knee(it)]
            }
            Self::HipRotation(it) => vec![Hip(Right), Hip(Left), Neck, Knee(it), Ankle(it)],
            Self::KneeFlexion(it) => vec![Hip(it), Knee(it), Ankle(it)],
            Self::AnkleDorsiflexion(it) => vec![Knee(it), Ankle(it), Heel(it), BigToe(it)],
            Self::ShoulderElevation(it) => all(&[Shoulder(it), Elbow(it)]),
            Self::ShoulderPlane(it) => all(&[Shoulder(Right), Shoulder(Left), Elbow(it)]),
            Self::ShoulderRotation(it) => {
                all(&[Shoulder(Right), Shoulder(Left), Elbow(it), Wrist(it)])
            }
            Self::ElbowFlexion(it) => vec![Shoulder(it), Elbow(it), Wrist(it)],
        }
    }

    /// Returns the angle, in degrees; `None` if the points do not define it.
    ///
    /// * `points`: in the order of [`Self::roles`].
    pub(super) fn degrees(self, points: &[Vector3<f64>], up: &UnitVector3<f64>) -> Option<f64> {
        match self {
            Self::TrunkForwards | Self::TrunkSideways => self.lean(points, up),
            Self::TrunkRotation => trunk_rotation(points),
            Self::TrunkBend => {
                let [right, trunk] = pelvis(points)?;
                Some(trunk.dot(&right).clamp(-1.0, 1.0).asin().to_degrees())
            }
            Self::HipFlexion(side) | Self::HipAbduction(side) => self.hip(side, points),
            Self::HipRotation(side) => hip_rotation(side, points),
            Self::KneeFlexion(_) | Self::ElbowFlexion(_) => {
                let upper = direction(&points[0], &points[1])?;
                let lower = direction(&points[1], &points[2])?;
                Some(between(&upper, &lower))
            }
            Self::AnkleDorsiflexion(_) => {
                let shin = direction(&points[1], &points[0])?;
                let foot = direction(&points[2], &points[3])?;
                Some(90.0 - between(&shin, &foot))
            }
            Self::ShoulderElevation(_) => {
                let [_, trunk] = pelvis(points)?;
                let arm = direction(&points[3], &points[4])?;
                Some(between(&-trunk, &arm))
            }
            Self::ShoulderPlane(side) => {
                let (arm, _) = arm(side, points)?;
                is_told(arm.x, arm.z).then(|| arm.x.atan2(arm.z).to_degrees())
            }
            Self::ShoulderRotation(side) => shoulder_rotation(side, points),
        }
    }

    fn lean(self, points: &[Vector3<f64>], up: &UnitVector3<f64>) -> Option<f64> {
        let [right, trunk] = pelvis(points)?;
        let trunk = axes_up(up, &right)?.tr_mul(&trunk);
        let along = if self == Self::TrunkForwards {
            trunk.x
        } else {
            trunk.z
        };
        is_told(along, trunk.y).then(|| along.atan2(trunk.y).to_degrees())
    }

    fn hip(self, side: Side, points: &[Vector3<f64>]) -> Option<f64> {
        let thigh = thigh(side, points)?;
        if let Self::HipAbduction(_) = self {
            return Some((outwards(side) * thigh.z).clamp(-1.0, 1.0).asin().to_degrees());
        }
        is_told(thigh.x, thigh.y).then(|| thigh.x.atan2(-thigh.y).to_degrees())
    }
}

/// 1 on the right side, where z points outwards; -1 on the left side.
fn outwards(side: Side) -> f64 {
    match side {
        Side::Right => 1.0,
        Side::Left => -1.0,
    }
}

/// Returns true if the vector with these two components is long enough to have a reliable direction.
fn is_told(a: f64, b: f64) -> bool {
    a.hypot(b) > LEAST_TILT
}

/// Returns the hip line towards the right, and the trunk.
///
/// * `points`: right hip, left hip, neck, ...
fn pelvis(points: &[Vector3<f64>]) -> Option<[Vector3<f64>; 2]> {
    let right = direction(&points[1], &points[0])?;
    let trunk = direction(&((points[0] + points[1]) * 0.5), &points[2])?;
    Some([right, trunk])
}

/// Returns the direction of the thigh in the axes of the pelvis that keep the hip line.
fn thigh(side: Side, points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let [right, trunk] = pelvis(points)?;
    let hip = if side == Side::Right {
        &points[0]
    } else {
        &points[1]
    };
    let thigh = direction(hip, &points[3])?;
    Some(axes_right(&right, &trunk)?.tr_mul(&thigh))
}

/// Returns the third rotation, about the thigh, in the joint coordinates of Grood & Suntay as in Wu et al. 2002.
///
/// The knee's bending axis points from left to right and is perpendicular to thigh and lower leg; the epicondyles are not known.
fn hip_rotation(side: Side, points: &[Vector3<f64>]) -> Option<f64> {
    let [right, trunk] = pelvis(points)?;
    let axes = axes_right(&right, &trunk)?;
    let thigh = thigh(side, points)?;
    let shank = axes.tr_mul(&direction(&points[3], &points[4])?);
    // In a bent knee, the lower leg points backwards, so the bending axis points to the right on both sides.
    let hinge = shank.cross(&thigh).try_normalize(LEAST_BEND)?;
    // Bending axis after flexion and abduction alone: perpendicular to the thigh, in the plane of the thigh and z.
    let neutral = (Vector3::z() - thigh * thigh.z).try_normalize(LEAST_TILT)?;
    let turn = thigh.dot(&neutral.cross(&hinge)).atan2(neutral.dot(&hinge));
    // The thigh points downwards, so a positive rotation about it moves the right end of the axis backwards, which is outwards on the
    // right side.
    Some((-outwards(side) * turn).to_degrees())
}

fn trunk_rotation(points: &[Vector3<f64>]) -> Option<f64> {
    let [right, trunk] = pelvis(points)?;
    let shoulders = direction(&points[4], &points[3])?;
    let axes = axes_up(&trunk, &right)?;
    let line = axes.tr_mul(&shoulders);
    is_told(line.x, line.z).then(|| line.x.atan2(line.z).to_degrees())
}

/// Returns the direction of the upper arm in the axes of the thorax, with z pointing outwards; also returns these axes.
///
/// * `points`: right hip, left hip, neck, right shoulder, left shoulder, elbow, ...
fn arm(side: Side, points: &[Vector3<f64>]) -> Option<(Vector3<f64>, nalgebra::Matrix3<f64>)> {
    let trunk = direction(&((points[0] + points[1]) * 0.5), &points[2])?;
    let right = direction(&points[4], &points[3])?;
    let axes = axes_up(&trunk, &right)?;
    let shoulder = if side == Side::Right {
        &points[3]
    } else {
        &points[4]
    };
    let mut arm = axes.tr_mul(&direction(shoulder, &points[5])?);
    arm.z *= outwards(side);
    Some((arm, axes))
}

/// Returns the third rotation of Y-X-Y as in Wu et al. 2005, with the elbow's bending axis instead of the epicondyles.
fn shoulder_rotation(side: Side, points: &[Vector3<f64>]) -> Option<f64> {
    let (arm, axes) = arm(side, points)?;
    if !is_told(arm.x, arm.z) {
        return None;
    }
    let mut forearm = axes.tr_mul(&direction(&points[5], &points[6])?);
    forearm.z *= outwards(side);
    // After mirroring, the left arm equals the right arm. A hanging arm bends forwards about an axis that points outwards.
    let hinge = arm.cross(&forearm).try_normalize(LEAST_BEND)?;
    // The arm is elevated about x for abduction (plane 0), and about -z for flexion (plane 90). Without a third rotation, the elbow's
    // bending axis stays perpendicular to this axis.
    let (sin, cos) = arm.x.atan2(arm.z).sin_cos();
    let neutral = arm.cross(&Vector3::new(cos, 0.0, -sin));
    let turn = arm.dot(&neutral.cross(&hinge)).atan2(neutral.dot(&hinge));
    // The third rotation is about the arm, upwards.
    Some(-turn.to_degrees())
}

impl fmt::Display for Angle {
    /// Writes the name used in files, for example `right knee flexion`.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (side, name) = match self {
            Self::TrunkForwards => return out.write_str("trunk lean forwards"),
            Self::TrunkSideways => return out.write_str("trunk lean right"),
            Self::TrunkRotation => return out.write_str("trunk rotation left"),
            Self::TrunkBend => return out.write_str("trunk bend right"),
            Self::HipFlexion(it) => (it, "hip flexion"),
            Self::HipAbduction(it) => (it, "hip abduction"),
            Self::HipRotation(it) => (it, "hip internal rotation"),
            Self::KneeFlexion(it) => (it, "knee flexion"),
            Self::AnkleDorsiflexion(it) => (it, "ankle dorsiflexion"),
            Self::ShoulderElevation(it) => (it, "shoulder elevation"),
            Self::ShoulderPlane(it) => (it, "shoulder plane of elevation"),
            Self::ShoulderRotation(it) => (it, "shoulder internal rotation"),
            Self::ElbowFlexion(it) => (it, "elbow flexion"),
        };
        write!(out, "{} {name}", side.name())
    }
}
