//! Poses of cameras, estimated from people walking about.
//!
//! The estimate has three steps:
//!
//! - The joints that two cameras see at the same instant give the pose of one camera relative to the other. It is found by the eight-point
//!   essential matrix with RANSAC, and refined robustly from several starts.
//! - The pose of each further camera is found from the joints whose positions are then known (resection).
//! - All cameras, joints, bone lengths and time offsets are adjusted together.
//!
//! Pictures have no scale. The scale comes from a person's height, from one known distance, or from a given rig. The vertical and the floor
//! come from feet that stand. One person is enough. If there are several people, the person whom the cameras see longest is used.
//!
//! To check the result, two halves of the recording are calibrated independently. They must give the same rig.

pub(crate) mod adjust;
pub(crate) mod begin;
mod bias;
pub(crate) mod certainty;
mod doubt;
pub(crate) mod estimate;
mod floor;
mod frame;
mod instant;
pub(crate) mod measure;
pub mod misfit;
mod outcome;
mod resect;
pub(crate) mod sides;
pub(crate) mod sightings;
pub(crate) mod solve;
mod two_view;

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub use doubt::Doubt;
pub use estimate::{PeopleError, estimate};
pub use floor::{Floor, floor};
pub use frame::{Scale, Skeletons, Vertical};
pub use outcome::{CameraReport, Outcome};

use crate::synchronisation::Film;

use geometry::Camera;

/// Settings of a calibration from people.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Number of joints; the first 14 are those of `skeleton::PARSE14`.
    pub n_joints: usize,
    /// For each joint, the index of the corresponding joint on the other side of the body.
    pub sides: Vec<usize>,
    /// True if some camera labels left and right as they appear in the picture, so that cameras may contradict each other.
    pub as_seen: bool,
    /// Known offset to add to the times of each camera to get common times, in seconds.
    pub offsets_s: Vec<f64>,
    /// Largest possible error of `offsets_s`, in seconds; offsets are searched within this range. Errors of a few frames are found even if
    /// this range is 0.
    pub window_s: f64,
    /// Source of the scale.
    pub scale: Scale,
    /// True if focal lengths are estimated as well, which is less certain.
    pub focal: bool,
    /// Maximum number of instants to use.
    pub most_instants: usize,
    /// Seed for the samples of RANSAC; the same seed gives the same result.
    pub seed: u64,
}

/// The cameras, and their films (the people in each camera's pictures) in the same order. Only the intrinsics of the cameras are used,
/// except with [`Scale::Rig`], which also uses their poses.
#[derive(Debug, Clone, Copy)]
pub struct Recording<'a> {
    /// The cameras.
    pub cameras: &'a [Camera],
    /// Film of each camera, with times of the camera's own clock.
    pub films: &'a [Film],
}
