//! Generated motion: computes the pose at any time from an action, a subject and a seed.

mod gait;
mod keys;
mod stance;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::body::{Bones, COLLAR, FOOT, Pose, UPPER_ARM, clamped};
use crate::random::Random;
use crate::room::Block;
use crate::subject::Subject;
use stance::Stance;

/// Action of the person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Action {
    /// Walking around the middle of the room.
    Walking,
    /// Jogging around the middle of the room.
    Jogging,
    /// Punches, hooks and uppercuts from a boxer's guard.
    Boxing,
    /// Waving, pointing, beckoning, crossing the arms, hands on hips.
    Gestures,
    /// Throwing a ball and catching it.
    ThrowCatch,
    /// Sitting down on a chair and getting up.
    Chair,
    /// Picking things up and putting them on a shelf.
    Grab,
    /// Leaning on a table, on one's own knees, or against a pillar.
    Lean,
    /// Working at a table.
    Table,
    /// Lying on a mat.
    Lying,
}

impl Action {
    /// All actions.
    pub const ALL: [Self; 10] = [
        Self::Walking,
        Self::Jogging,
        Self::Boxing,
        Self::Gestures,
        Self::ThrowCatch,
        Self::Chair,
        Self::Grab,
        Self::Lean,
        Self::Table,
        Self::Lying,
    ];

    /// Returns the name of the action on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Walking => "walking",
            Self::Jogging => "jogging",
            Self::Boxing => "boxing",
            Self::Gestures => "gestures",
            Self::ThrowCatch => "throw-catch",
            Self::Chair => "chair",
            Self::Grab => "grab",
            Self::Lean => "lean",
            Self::Table => "table",
            Self::Lying => "lying",
        }
    }

    /// Returns the action with that name, if there is one.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }
}

/// A person doing an action.
#[derive(Debug, Clone)]
pub(crate) struct Motion {
    pub(crate) bones: Bones,
    actor: Actor,
    action: Action,
}

/// Parameters that every action uses.
#[derive(Debug, Clone)]
struct Actor {
    subject: Subject,
    random: Random,
    /// Initial direction that the person faces, in radians from x to y.
    heading: f64,
    /// Position of the person, or centre of the person's path, in metres.
    place: [f64; 2],
}

impl Motion {
    /// Creates the motion of an action. The same subject, action and seed move the same way.
    pub(crate) fn new(subject: &Subject, action: Action, seed: u64) -> Self {
        let random = Random::new(seed).fork("motion").nth(subject.number).fork(action.name());
        let mut stage = random.fork("stage");
        let bones = Bones::new(&subject.proportions);
        let place = [stage.range(-0.25, 0.25), stage.range(-0.25, 0.25)];
        let heading = stage.range(0.0, core::f64::consts::TAU);
        Self {
            bones,
            actor: Actor {
                subject: subject.clone(),
                random,
                heading,
                place,
            },
            action,
        }
    }

    /// Returns the pose at a time, in the frame of the stage: in metres, z up, the floor at 0.
    pub(crate) fn pose(&self, seconds: f64) -> Pose {
        let action = self.action;
        let mut stance = match action {
            Action::Walking => gait::walking(&self.actor, seconds),
            Action::Jogging => gait::jogging(&self.actor, seconds),
            _ => keys::stance(&self.actor, action, seconds),
        };
        stance.sway(&self.actor, seconds);
        self.grounded(&stance)
    }

    /// Returns the standing height of the person, in metres.
    pub(crate) fn height(&self) -> f64 {
        self.actor.subject.proportions.height
    }

    /// Chairs, tables and mats that the action needs, in the frame of the stage.
    pub(crate) fn furniture(&self) -> Vec<Block> {
        keys::furniture(self, self.action)
    }

    /// Moves the person so that the lowest point is on the floor, and the feet (or the pelvis) are at their position.
    fn grounded(&self, stance: &Stance) -> Pose {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), stance.heading)
            * UnitQuaternion::from_euler_angles(stance.roll.to_radians(), 0.0, 0.0)
            * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), stance.pitch.to_radians())
            * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), stance.spin.to_radians());
        let mut pose = Pose {
            root: Isometry3::from_parts(Translation3::identity(), turn),
            angles: clamped(&stance.angles),
        };
        let frames = self.bones.frames(&pose);
        let middle = if stance.planted {
            let feet = FOOT.map(|foot| frames[foot].translation.vector);
            (feet[0] + feet[1]) / 2.0
        } else {
            Vector3::zeros()
        };
        let [x, y] = stance.place;
        let z = stance.lift - self.bones.lowest(&frames, self.height());
        pose.root.translation = Translation3::new(x - middle.x, y - middle.y, z);
        pose
    }
}

impl Stance {
    /// Adds a slow sway to every joint, and raises the collar bones with the arms.
    fn sway(&mut self, actor: &Actor, seconds: f64) {
        for (bone, angles) in self.angles.iter_mut().enumerate() {
            for (axis, angle) in angles.iter_mut().enumerate() {
                let mut random = actor.random.fork("sway").nth((3 * bone + axis) as u64);
                let size = random.range(0.6, 2.2);
                for hertz in [0.23, 0.61] {
                    let hertz = hertz * random.range(0.8, 1.25);
                    let phase = random.range(0.0, core::f64::consts::TAU);
                    *angle += size * (core::f64::consts::TAU * hertz * seconds + phase).sin();
                }
            }
        }
        for side in 0..2 {
            let [flexion, abduction, _] = self.angles[UPPER_ARM[side]];
            let raised = flexion.max(abduction) - 40.0;
            self.angles[COLLAR[side]][1] += 0.2 * raised.max(0.0);
        }
    }
}

#[cfg(test)]
mod tests;
