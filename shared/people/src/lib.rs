//! Who is who among the people that several cameras see, and where their joints are.
//!
//! [`Tracker`] is given what a detector found in every view of a frame, joints in pixels with their deviations, and says which
//! detections are one person, by an id that lasts ([`Person`]). [`Solver`] is given the people, and says where their joints are, by all
//! that the views saw and not only by what a detector made one detection of. Distances are in metres, weighted by the stated
//! deviations, so that one gate holds for every rig.
//!
//! The same input gives the same bits. The order of views and of detections changes nothing: views are taken in the order of the
//! cameras' names, detections in that of their pixels. Nothing here reads a clock or a file.
#![forbid(unsafe_code)]

mod assignment;
mod settings;
mod sight;

mod distance;
mod frame;

mod cluster;
mod coarse;

mod bones;
mod track;

mod memory;

mod tracker;

mod hypotheses;
mod solver;
mod tree;

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

use nalgebra::Vector3;
use skeleton::body::{Covariances, Joints};

pub(crate) use frame::Frame;
pub use memory::{Memory, Remembered};
pub use settings::Settings;
pub use solver::{Solved, Solver};
pub use tracker::Tracker;

/// Number of joints, those of `skeleton::PARSE14`.
pub(crate) const N: usize = skeleton::body::N_JOINTS;

pub(crate) use skeleton::MIRRORED as MIRROR;

/// A joint in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// The place, pixels of the recorded picture.
    pub at_px: [f64; 2],
    /// Standard deviation of the place along each axis, pixels.
    pub sd_px: f64,
    /// How sure the detector is that this is the joint, 0 to 1.
    pub heat: f64,
}

/// A person whom a detector found in a view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// The joints of `skeleton::PARSE14`, in its order; `None` where the joint was not found.
    pub joints: [Option<Keypoint>; N],
    /// The colour of the trunk, each channel from 0 to 1; tells people apart who leave and come back.
    pub colour: Option<[f64; 3]>,
}

/// Everything that a detector found in a view.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct View {
    /// The people.
    pub detections: Vec<Detection>,
    /// Places of each joint that the detector assigned to no person, in the order of `skeleton::PARSE14`; empty if the
    /// detector does not give them.
    pub loose: Vec<Vec<Keypoint>>,
}

/// How well a person is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// First given in this frame.
    New,
    /// Seen by enough views.
    Tracked,
    /// Seen by one view only, or too near to another person to tell the two apart.
    Unsure,
    /// Not seen in this frame; the joints are where they are expected.
    Lost,
}

/// A person of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// Lasting identity, from 1; never used for another person.
    pub id: u64,
    /// How well the person is known.
    pub state: State,
    /// Index of the person among the detections of every view; `None` where the view does not show the person.
    pub detections: Vec<Option<usize>>,
    /// Set if a view calls left what is the person's right; only where views call the sides as they see them.
    pub is_exchanged: Vec<bool>,
    /// The joints, coarsely, metres in the world.
    pub joints: Joints,
    /// Their covariances, square metres.
    pub covariances: Covariances,
    /// Velocity of the trunk, metres a second.
    pub velocity: Vector3<f64>,
}
