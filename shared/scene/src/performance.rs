//! The motion of the person of a scene: a generated action or a recording.

use nalgebra::Isometry3;

use crate::body::{Bones, N_BONES};
use crate::motion::Motion;
use crate::recorded::Recorded;
use crate::room::Block;

/// A person in motion.
#[derive(Debug)]
pub(crate) struct Performance {
    pub(crate) bones: Bones,
    /// Standing height of the person, in metres.
    pub(crate) height: f64,
    /// Name of the action as written to the ground truth.
    pub(crate) name: String,
    pub(crate) course: Course,
}

/// Source of the person's motion.
#[derive(Debug)]
pub(crate) enum Course {
    Acted(Box<Motion>),
    Recorded(Box<Recorded>),
}

impl Performance {
    /// Returns the frames of reference of all bones at a time, in the frame of the stage.
    pub(crate) fn frames(&self, seconds: f64) -> [Isometry3<f64>; N_BONES] {
        match &self.course {
            Course::Acted(motion) => self.bones.frames(&motion.pose(seconds)),
            Course::Recorded(recorded) => recorded.frames(seconds),
        }
    }

    /// Returns the chairs, tables and mats that the action needs; empty for a recording, because they are unknown.
    pub(crate) fn furniture(&self) -> Vec<Block> {
        match &self.course {
            Course::Acted(motion) => motion.furniture(),
            Course::Recorded(_) => Vec::new(),
        }
    }
}
