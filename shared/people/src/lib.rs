//! Identifies the people that several cameras see, and finds where their joints are.
//!
//! [`Tracker`] takes the output of a detector for every view of a frame: joints in pixels with their deviations. It groups the detections
//! into people with lasting ids ([`Person`]). [`Solver`] takes these people and computes their joints. It uses all keypoints of the views,
//! not only those that the detector assigned to a person. Distances are in metres and weighted by the stated deviations, so the same limits
//! can be used for every rig.
//!
//! The same input gives bit-identical results. The order of views and of detections has no effect: views are processed in the order of
//! their cameras' names, and detections in the order of their pixel positions. The crate does not read the clock or any file.
#![forbid(unsafe_code)]

mod assignment;
mod settings;
mod sight;

mod distance;
mod frame;

mod cluster;
mod coarse;
mod colour;

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

/// Number of joints in `skeleton::PARSE14`.
pub(crate) const N: usize = skeleton::body::N_JOINTS;

pub(crate) use skeleton::MIRRORED as MIRROR;

/// A joint in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// Position of the joint, in pixels of the recorded picture.
    pub at_px: [f64; 2],
    /// Standard deviation of the position along each axis, in pixels.
    pub sd_px: f64,
    /// Confidence of the detector in this joint, 0 to 1.
    pub heat: f64,
}

/// A person found by a detector in one view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detection {
    /// The joints of `skeleton::PARSE14`, in its order; `None` where the joint was not found.
    pub joints: [Option<Keypoint>; N],
    /// Colour of the trunk, each channel from 0 to 1. It distinguishes people who are close to each other, and identifies people who come
    /// back.
    pub colour: Option<[f64; 3]>,
}

/// Everything that a detector found in one view.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct View {
    /// The detected people.
    pub detections: Vec<Detection>,
    /// For each joint, the keypoints that the detector assigned to no person, in the order of `skeleton::PARSE14`; empty if the detector
    /// does not report such keypoints.
    pub loose: Vec<Vec<Keypoint>>,
}

/// How reliably a person is tracked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Reported for the first time in this frame.
    New,
    /// Seen by enough views to be tracked.
    Tracked,
    /// Seen by only one view, or too close to another person to be distinguished.
    Unsure,
    /// Not seen in this frame; the joints are at their expected positions.
    Lost,
}

/// A tracked person in a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// Lasting id, counted from 1; never reused for another person.
    pub id: u64,
    /// How reliably the person is tracked.
    pub state: State,
    /// Index of the person's detection in every view; `None` if the view does not show the person.
    pub detections: Vec<Option<usize>>,
    /// For every view, true if it labels the person's right side as left. This only occurs if views name left and right as they appear in
    /// the picture.
    pub is_exchanged: Vec<bool>,
    /// Coarse positions of the joints, in metres in the world.
    pub joints: Joints,
    /// Covariances of the joints, in square metres.
    pub covariances: Covariances,
    /// Velocity of the trunk, in metres per second.
    pub velocity: Vector3<f64>,
}
