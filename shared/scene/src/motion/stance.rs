//! A pose before joint limits and the floor are applied: joint angles, and the position of the body in the room.

use crate::body::{
    ABDOMEN, Angles, CHEST, FOOT, FOREARM, HAND, HEAD, N_BONES, NECK, SHIN, THIGH, UPPER_ARM,
};
use crate::subject::Subject;

/// A pose with angles in degrees as in [`Angles`], before joint limits and the floor are applied.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stance {
    pub(super) angles: Angles,
    /// Direction that the person faces, in radians from x to y.
    pub(super) heading: f64,
    /// Rotations of the pelvis in degrees: forward, to the right, and about the person's own axis.
    pub(super) pitch: f64,
    pub(super) roll: f64,
    pub(super) spin: f64,
    /// Position of the point midway between the feet (or between the hips), in metres.
    pub(super) place: [f64; 2],
    /// True if `place` is the position of the feet.
    pub(super) planted: bool,
    /// Height of the lowest point above the floor, in metres.
    pub(super) lift: f64,
}

impl Stance {
    /// Returns a person who stands in the style of the subject.
    pub(super) fn standing(subject: &Subject) -> Self {
        let style = subject.style;
        let mut stance = Self {
            angles: [[0.0; 3]; N_BONES],
            heading: 0.0,
            pitch: 0.0,
            roll: 0.0,
            spin: 0.0,
            place: [0.0; 2],
            planted: true,
            lift: 0.0,
        };
        stance.angles[CHEST][0] = style.stoop;
        stance.angles[NECK][0] = 4.0 + style.stoop;
        stance.angles[HEAD][0] = -3.0 - style.stoop;
        for side in 0..2 {
            stance.angles[UPPER_ARM[side]] = [3.0, style.arms_out, -6.0];
            stance.angles[FOREARM[side]] = [style.elbows, 0.0, -10.0];
            stance.angles[HAND[side]] = [8.0, 0.0, 0.0];
            stance.angles[THIGH[side]] = [1.0, 3.5, style.toes_out];
            stance.angles[SHIN[side]] = [3.0, 0.0, 0.0];
        }
        stance
    }

    pub(super) fn arm(mut self, side: usize, shoulder: [f64; 3], elbow: f64) -> Self {
        self.angles[UPPER_ARM[side]] = shoulder;
        self.angles[FOREARM[side]][0] = elbow;
        self
    }

    pub(super) fn arms(self, shoulder: [f64; 3], elbow: f64) -> Self {
        self.arm(0, shoulder, elbow).arm(1, shoulder, elbow)
    }

    pub(super) fn leg(mut self, side: usize, hip: f64, knee: f64) -> Self {
        self.angles[THIGH[side]][0] = hip;
        self.angles[SHIN[side]][0] = knee;
        self
    }

    pub(super) fn legs(self, hip: f64, knee: f64) -> Self {
        self.leg(0, hip, knee).leg(1, hip, knee)
    }

    /// Bends the trunk forward and to the right, and turns it left.
    pub(super) fn trunk(mut self, bend: f64, aside: f64, turn: f64) -> Self {
        self.angles[ABDOMEN][0] += 0.6 * bend;
        self.angles[CHEST][0] += 0.4 * bend;
        self.angles[ABDOMEN][1] += 0.5 * aside;
        self.angles[CHEST][1] += 0.5 * aside;
        self.angles[ABDOMEN][2] += 0.35 * turn;
        self.angles[CHEST][2] += 0.65 * turn;
        self
    }

    /// Turns the face down and left.
    pub(super) fn look(mut self, down: f64, left: f64) -> Self {
        self.angles[NECK][0] += 0.5 * down;
        self.angles[HEAD][0] += 0.5 * down;
        self.angles[NECK][2] += 0.5 * left;
        self.angles[HEAD][2] += 0.5 * left;
        self
    }

    pub(super) fn pitched(mut self, forward: f64) -> Self {
        self.pitch = forward;
        self
    }

    pub(super) fn rolled(mut self, right: f64) -> Self {
        self.roll = right;
        self
    }

    /// Rotates the ankles so that the soles are flat.
    pub(super) fn flat(mut self) -> Self {
        for side in 0..2 {
            let knee = self.angles[SHIN[side]][0];
            self.angles[FOOT[side]][0] = self.pitch - self.angles[THIGH[side]][0] + knee;
        }
        self
    }

    /// Interpolates between this stance and another; position and heading remain those of this stance.
    pub(super) fn towards(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        let angles = core::array::from_fn(|bone| {
            core::array::from_fn(|axis| mix(self.angles[bone][axis], other.angles[bone][axis]))
        });
        Self {
            angles,
            pitch: mix(self.pitch, other.pitch),
            roll: mix(self.roll, other.roll),
            spin: mix(self.spin, other.spin),
            lift: mix(self.lift, other.lift),
            ..self.clone()
        }
    }
}
