//! Recorded motion, transferred to the skeleton of a subject.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use statistics::Sorted;

use crate::body::{
    ABDOMEN, Bones, CHEST, COLLAR, FOOT, FOREARM, HAND, HEAD, LEFT, N_BONES, NECK, PARENT, PELVIS,
    RIGHT, SHIN, THIGH, UPPER_ARM,
};
use crate::truth::N_JOINTS;

/// Joint positions over time, from motion capture.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Name of the recording, used instead of the name of an action.
    pub name: String,
    /// Number of recorded postures per second.
    pub rate_hz: f64,
    /// The postures; at least one.
    pub postures: Vec<Posture>,
}

/// Positions of the joints at one time, in metres, z up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Posture {
    /// The joints of `skeleton::PARSE14`.
    pub joints: [[f64; 3]; N_JOINTS],
    /// The toes of the right and of the left foot, if known. If they are unknown, the direction of the feet is computed from the shins.
    pub toes: Option<[[f64; 3]; 2]>,
}

impl Recording {
    /// Returns the duration from the first posture to the last, in seconds.
    pub fn seconds(&self) -> f64 {
        self.postures.len().saturating_sub(1) as f64 / self.rate_hz
    }

    /// Returns the posture at a time, interpolated linearly; constant before the first and after the last.
    fn at(&self, seconds: f64) -> Posture {
        let last = self.postures.len() - 1;
        let place = (seconds * self.rate_hz).clamp(0.0, last as f64);
        let nth = (place as usize).min(last);
        let (from, to) = (self.postures[nth], self.postures[(nth + 1).min(last)]);
        let share = place - nth as f64;
        let mix = |a: [f64; 3], b: [f64; 3]| {
            core::array::from_fn(|axis| a[axis] + share * (b[axis] - a[axis]))
        };
        let pair = from.toes.zip(to.toes);
        Posture {
            joints: core::array::from_fn(|i| mix(from.joints[i], to.joints[i])),
            toes: pair.map(|(a, b)| core::array::from_fn(|i| mix(a[i], b[i]))),
        }
    }
}

/// Indices of hips in `skeleton::PARSE14`, left first.
const HIPS: [usize; 2] = [3, 2];
const KNEES: [usize; 2] = [4, 1];
const ANKLES: [usize; 2] = [5, 0];
const SHOULDERS: [usize; 2] = [9, 8];
const ELBOWS: [usize; 2] = [10, 7];
const WRISTS: [usize; 2] = [11, 6];
const NECK_JOINT: usize = 12;
const HEAD_JOINT: usize = 13;

/// Fraction of the postures whose lowest point may be below the floor; it is not 0 because recordings are inaccurate.
const BELOW_FLOOR: f64 = 0.05;

/// A recording transferred to a subject, with the bone directions of the recording and the bone lengths of the subject.
///
/// The path is scaled in proportion to the legs, moved to the middle of the room, and placed on the floor. Joint limits are not applied.
#[derive(Debug, Clone)]
pub(crate) struct Recorded {
    recording: Recording,
    bones: Bones,
    /// Ratio of the subject's size to that of the recorded person.
    scale: f64,
    /// Vector that moves the scaled recording to the stage.
    shift: Vector3<f64>,
}

impl Recorded {
    /// * `height`: height of the subject, in metres.
    pub(crate) fn new(recording: &Recording, bones: &Bones, height: f64) -> Self {
        let mut recorded = Self {
            scale: leg(bones) / recorded_leg(recording),
            recording: recording.clone(),
            bones: bones.clone(),
            shift: Vector3::zeros(),
        };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut lowest = Vec::new();
        for posture in &recorded.recording.postures {
            let frames = recorded.posed(posture);
            let at = frames[PELVIS].translation.vector;
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
            lowest.push(recorded.bones.lowest(&frames, height));
        }
        lowest.sort_by(f64::total_cmp);
        let floor = lowest[(BELOW_FLOOR * lowest.len() as f64) as usize];
        let middle = [0, 1].map(|axis| f64::midpoint(low[axis], high[axis]));
        recorded.shift = -Vector3::new(middle[0], middle[1], floor);
        recorded
    }

    /// Returns the frames of all bones at a time, in the frame of the stage.
    pub(crate) fn frames(&self, seconds: f64) -> [Isometry3<f64>; N_BONES] {
        self.posed(&self.recording.at(seconds))
    }

    fn posed(&self, posture: &Posture) -> [Isometry3<f64>; N_BONES] {
        let turns = turns(&self.bones, posture);
        let joint = |i: usize| Vector3::from(posture.joints[i]);
        let hips = (joint(HIPS[LEFT]) + joint(HIPS[RIGHT])) / 2.0;
        let root = hips * self.scale + self.shift;
        let mut frames = turns.map(|turn| Isometry3::from_parts(Translation3::from(root), turn));
        for bone in 1..N_BONES {
            let Some(parent) = PARENT[bone] else { continue };
            let at = frames[parent] * Point3::from(self.bones.offset[bone]);
            frames[bone].translation = at.into();
        }
        frames
    }
}

/// Returns the length of a leg, in metres.
fn leg(bones: &Bones) -> f64 {
    bones.offset[SHIN[LEFT]].norm() + bones.offset[FOOT[LEFT]].norm()
}

/// Returns the median length of the recorded legs, in metres.
fn recorded_leg(recording: &Recording) -> f64 {
    let length = |posture: &Posture, side: usize| {
        let [hip, knee, ankle] =
            [HIPS, KNEES, ANKLES].map(|pair| Vector3::from(posture.joints[pair[side]]));
        (knee - hip).norm() + (ankle - knee).norm()
    };
    let all = recording.postures.iter();
    let all: Vec<f64> = all.flat_map(|posture| [0, 1].map(|side| length(posture, side))).collect();
    Sorted::new(all)
        .upper_median()
        .map_or(1e-3, |upper_median| upper_median.max(1e-3))
}

/// Returns the rotations of all bones, in the frame of the recording.
fn turns(bones: &Bones, posture: &Posture) -> [UnitQuaternion<f64>; N_BONES] {
    let joint = |i: usize| Vector3::from(posture.joints[i]);
    let across = |pair: [usize; 2]| joint(pair[LEFT]) - joint(pair[RIGHT]);
    let offset = &bones.offset;
    let mut turns = [UnitQuaternion::identity(); N_BONES];
    let hips = (joint(HIPS[LEFT]) + joint(HIPS[RIGHT])) / 2.0;
    let spine = offset[ABDOMEN] + offset[CHEST] + offset[NECK];
    let up = joint(NECK_JOINT) - hips;
    turns[PELVIS] = turned(spine, up, across(HIPS));
    turns[CHEST] = turned(spine, up, across(SHOULDERS));
    let half = turns[PELVIS].try_slerp(&turns[CHEST], 0.5, 1e-9);
    turns[ABDOMEN] = half.unwrap_or(turns[CHEST]);
    let head = joint(HEAD_JOINT) - joint(NECK_JOINT);
    turns[HEAD] = turned(offset[HEAD] + bones.head_top, head, across(SHOULDERS));
    turns[NECK] = turns[HEAD];
    for side in [LEFT, RIGHT] {
        turns[COLLAR[side]] = turns[CHEST];
        let arm = [SHOULDERS, ELBOWS, WRISTS].map(|pair| joint(pair[side]));
        // The forearm bends forward, and the shin bends backward.
        let [upper, fore] = hinged(&turns[CHEST], arm, -1.0);
        turns[UPPER_ARM[side]] = upper;
        turns[FOREARM[side]] = fore;
        turns[HAND[side]] = fore;
        let leg = [HIPS, KNEES, ANKLES].map(|pair| joint(pair[side]));
        let [thigh, shin] = hinged(&turns[PELVIS], leg, 1.0);
        turns[THIGH[side]] = thigh;
        turns[SHIN[side]] = shin;
        turns[FOOT[side]] = match posture.toes {
            Some(toes) => {
                let toe = Vector3::from(toes[1 - side]) - leg[2];
                turned(bones.sole[0], toe, shin * Vector3::y())
            }
            None => shin,
        };
    }
    turns
}

/// Returns the rotations of the two bones of a limb, which hang down at rest, from the positions of its three joints.
///
/// The axis of the hinge between the two bones is computed from the bend; for a straight limb, the axis of the trunk is used.
///
/// * `fold`: 1 if the limb bends backward, -1 if it bends forward.
fn hinged(
    trunk: &UnitQuaternion<f64>,
    [top, middle, end]: [Vector3<f64>; 3],
    fold: f64,
) -> [UnitQuaternion<f64>; 2] {
    let down = -Vector3::z();
    let upper = unit(middle - top, trunk * down);
    let lower = unit(end - middle, upper);
    let carried = UnitQuaternion::rotation_between(&(trunk * down), &upper)
        .unwrap_or_else(UnitQuaternion::identity);
    let straight = carried * (trunk * Vector3::y());
    let bend = fold * upper.cross(&lower);
    // Between 9 and 27 degrees of bend, the two axes are blended.
    let share = ((bend.norm() - 0.15) / 0.3).clamp(0.0, 1.0);
    let share = share * share * (3.0 - 2.0 * share);
    let axis = straight * (1.0 - share) + unit(bend, straight) * share;
    let upper = turned(down, upper, axis);
    [upper, turned(down, lower, upper * Vector3::y())]
}

/// Returns the rotation that maps `from` to the direction of `along`, and the y axis as close to `left` as possible.
fn turned(from: Vector3<f64>, along: Vector3<f64>, left: Vector3<f64>) -> UnitQuaternion<f64> {
    let basis = |along: Vector3<f64>, left: Vector3<f64>| {
        let along = unit(along, Vector3::z());
        let any = if along.y.abs() < 0.9 {
            Vector3::y()
        } else {
            Vector3::x()
        };
        let off = |vector: Vector3<f64>| vector - along * vector.dot(&along);
        let left = unit(off(left), unit(off(any), Vector3::y()));
        Matrix3::from_columns(&[left.cross(&along), left, along])
    };
    let turn = basis(along, left) * basis(from, Vector3::y()).transpose();
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn))
}

/// Returns the unit vector in the direction of `it`, or `other` for a zero vector.
fn unit(it: Vector3<f64>, other: Vector3<f64>) -> Vector3<f64> {
    it.try_normalize(1e-9).unwrap_or(other)
}

#[cfg(test)]
mod tests;
