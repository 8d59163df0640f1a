//! Where cameras stand, from people walking about.
//!
//! The joints that two cameras see at one instant give the relative pose of both (essential matrix by eight points within
//! RANSAC, robust refinement from several starts); other cameras are put where they see the joints that are known then
//! (resection); and all cameras, joints, lengths of bones and time offsets are adjusted together. Pictures have no scale: the
//! scale is that of a person's height, of one distance, or of the rig that was given. The vertical and the floor are those of
//! the feet that stand. One person is enough; the one that the cameras see longest is used.
//!
//! The honest check is that two halves of the recording, each separately from the beginning, give the same rig.

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
    /// The mirror of each joint on the other side of the body.
    pub sides: Vec<usize>,
    /// True if left and right are those of the picture in some camera, so that cameras may contradict each other.
    pub as_seen: bool,
    /// Offset added to the times of each camera to have common ones, as far as it is known, seconds.
    pub offsets_s: Vec<f64>,
    /// How far these may be wrong, seconds: offsets are searched within. A few frames are found without.
    pub window_s: f64,
    /// Source of the scale.
    pub scale: Scale,
    /// True if focal lengths are estimated, too: less certain.
    pub focal: bool,
    /// The most instants that are looked at.
    pub most_instants: usize,
    /// For the samples of RANSAC: the same number gives the same answer.
    pub seed: u64,
}

/// Films of the cameras, and the cameras in the same order. Only their intrinsics count, except for [`Scale::Rig`],
/// which uses the poses.
#[derive(Debug, Clone, Copy)]
pub struct Recording<'a> {
    /// The cameras.
    pub cameras: &'a [Camera],
    /// Film of each camera, by its own clock.
    pub films: &'a [Film],
}
