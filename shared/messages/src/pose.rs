//! Poses in one view and in pairs of views.

use bytemuck::Zeroable as _;
use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_CANDIDATES, MAX_JOINTS, MAX_PARTS, MAX_VIEW_KEYPOINTS, Stamp, Status, Timing};

/// One pose: `fmp::Pose`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PoseMessage.v1")]
#[repr(C)]
pub struct PoseMessage {
    /// Score of the pose.
    pub score: f32,
    /// Level of the pyramid, counted from 0.
    pub level: u16,
    /// Number of valid entries of the arrays.
    pub n_parts: u16,
    /// Column of every part, in response cells.
    pub x: [u16; MAX_PARTS],
    /// Row of every part, in response cells.
    pub y: [u16; MAX_PARTS],
    /// Type of every part, counted from 0.
    pub mixture: [u8; MAX_PARTS],
}

/// Measures of how well one part of the best candidate fits at its position: `fmp::LocalScore`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("LocalMessage.v1")]
#[repr(C)]
pub struct LocalMessage {
    /// Response of the part's filter.
    pub response: f32,
    /// Response minus the mean response around the position.
    pub contrast: f32,
    /// Response minus the best response of the part's other types.
    pub margin: f32,
}

/// Extent of the image and its pyramid that was searched for poses.
///
/// A transparent number rather than an enum: any received bit pattern is valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Searched.v1")]
#[repr(C)]
pub struct Searched(pub u32);

impl Searched {
    /// The whole image and pyramid.
    pub const FULL: Self = Self(0);
    /// The surroundings of the last pose.
    pub const TRACKED: Self = Self(1);

    /// Returns the name for messages to users.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::FULL => "full",
            Self::TRACKED => "tracked",
            Self(_) => "unknown",
        }
    }
}

/// Value used instead of a colour if the trunk is not visible, or if there is no picture.
pub const NO_COLOUR: [f32; 3] = [-1.0; 3];

/// The single-view result: distinct candidates, best first.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, Pod, Zeroable)]
#[type_name("Sightings.v1")]
#[repr(C)]
pub struct Sightings {
    /// Identity of the frame and the view.
    pub stamp: Stamp,
    /// Times at which the input arrived and the message was sent.
    pub timing: Timing,
    /// States whether there is a candidate and, if not, why.
    pub status: Status,
    /// Number of valid candidates.
    pub n_candidates: u32,
    /// Width of the image, in pixels.
    pub width: u32,
    /// Height of the image, in pixels.
    pub height: u32,
    /// Size of the responses that were sent as evidence, in bytes; 0 if no process subscribes to them.
    pub evidence_bytes: u64,
    /// Time from the instant of the frame until the picture was taken, in nanoseconds, as in [`FrameHeader`](crate::FrameHeader).
    pub skew_nanos: i64,
    /// Region that was searched.
    pub searched: Searched,
    /// Number of extra keypoints per candidate: all keypoints that any view of the deployment provides.
    pub n_keypoints: u32,
    /// The candidates. With the paper's method, they contain the cells of the parts. With the network method, they contain only a score;
    /// the rest is in `joints` and `heats`.
    pub candidates: [PoseMessage; MAX_CANDIDATES],
    /// Best position of every joint of every candidate, in pixels of the frame. Used by the network method only.
    pub joints: [[[f32; 2]; MAX_JOINTS]; MAX_CANDIDATES],
    /// Local scores of the parts of the first candidate.
    pub local: [LocalMessage; MAX_PARTS],
    /// Evidence in the picture for the direction in which the person of every candidate faces: `multiview::FrontEvidence`,
    /// `[towards the right of the picture, towards the camera]`. Zeros if there is no evidence.
    pub front: [[f32; 2]; MAX_CANDIDATES],
    /// Confidence of the network in every joint of every candidate, from 0 to 1. It is 0 for a joint that is not visible, and for all
    /// joints with the paper's method.
    pub heats: [[f32; MAX_JOINTS]; MAX_CANDIDATES],
    /// Median colour of the trunk of every candidate: red, green and blue from 0 to 1, or [`NO_COLOUR`]. Used by the network method only.
    pub colours: [[f32; 3]; MAX_CANDIDATES],
    /// Time since the network last ran on every candidate, in seconds; above 0 for people who were left out to save time. Used by the network
    /// method only.
    pub ages_s: [f32; MAX_CANDIDATES],
    /// The extra keypoints of one candidate after the other, for as many candidates as fit:
    /// `[column, row, standard deviation along one axis]`, in pixels of the frame. The deviation is 0 for a keypoint that was not found.
    pub keypoints: [[f32; 3]; MAX_VIEW_KEYPOINTS],
}

impl Default for Sightings {
    fn default() -> Self {
        Self::zeroed()
    }
}

/// The result of a pair of views under one assumption about whether both see the person from the same side.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PairHypothesis.v1")]
#[repr(C)]
pub struct PairHypothesis {
    /// Joint energy (eq. 3) at the end.
    pub energy: f64,
    /// Number of single-view solutions that were computed.
    pub n_iterations: u32,
    /// 1 if the poses had converged at the end, 0 if the limit of iterations was reached.
    pub converged: u32,
    /// 1 if left and right of the second view are swapped relative to the first view.
    pub exchanged: u32,
    /// The candidate of each view from which the pair started.
    pub start: [u8; 2],
    /// Explicit padding.
    pub reserved: [u8; 2],
    /// Bit `i` is set if the consistency terms of part `i` of the first view were switched on.
    pub active_parts: u64,
    /// The pose in the first and in the second view.
    pub poses: [PoseMessage; 2],
}

/// The result of one pair of views.
///
/// If all views are solved at once, the message carries the result for one view and for the first view with a result.
/// The energies are then those of all views, and `view` of the stamp is the index of the view minus 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PairPose.v3")]
#[repr(C)]
pub struct PairPose {
    /// Identity of the frame; `view` is the index of the pair.
    pub stamp: Stamp,
    /// Times at which the last input arrived and the message was sent.
    pub timing: Timing,
    /// States whether there is a hypothesis and, if not, why.
    pub status: Status,
    /// Number of valid hypotheses.
    pub n_hypotheses: u32,
    /// Indices of the two views, ascending.
    pub views: [u32; 2],
    /// The hypothesis that both views see the person from the same side, then the one that they see opposite sides. The second exists only
    /// if this must be decided.
    pub hypotheses: [PairHypothesis; 2],
    /// Bit `v` is set if the pose of view `v` arrived in time.
    pub views_present: u32,
    /// Age of the expected errors of each of the two views, in frames, plus 1. The value 1 means that they are of this frame; 0 means that
    /// there are no expected errors, so that every part counts as usable.
    pub sigma_age: [u16; 2],
    /// Predicted distance of every part's centre from the truth in each of the two views, in pixels of the frame. It is valid for as many
    /// parts as the poses have, and only if `sigma_age` is not 0.
    pub sigma_px: [[f32; MAX_PARTS]; 2],
}
