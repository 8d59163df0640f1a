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
    /// Level of the pyramid, from 0.
    pub level: u16,
    /// Number of valid entries of the arrays.
    pub n_parts: u16,
    /// Column of every part, response cells.
    pub x: [u16; MAX_PARTS],
    /// Row of every part, response cells.
    pub y: [u16; MAX_PARTS],
    /// Type of every part, from 0.
    pub mixture: [u8; MAX_PARTS],
}

/// How well one part of the best candidate fits at its position: `fmp::LocalScore`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("LocalMessage.v1")]
#[repr(C)]
pub struct LocalMessage {
    /// Response of the part's filter.
    pub response: f32,
    /// The response minus the mean response around it.
    pub contrast: f32,
    /// The response minus the best response of the part's other types.
    pub margin: f32,
}

/// How much of the image and of its pyramid was searched for poses.
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

    /// The name for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::FULL => "full",
            Self::TRACKED => "tracked",
            Self(_) => "unknown",
        }
    }
}

/// The single-view result: distinct candidates, best first.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, Pod, Zeroable)]
#[type_name("ViewPose.v8")]
#[repr(C)]
pub struct ViewPose {
    /// The frame and the view.
    pub stamp: Stamp,
    /// When it was received and sent.
    pub timing: Timing,
    /// Says that there is a candidate, or why there is none.
    pub status: Status,
    /// Number of valid candidates.
    pub n_candidates: u32,
    /// Width of the image, pixels.
    pub width: u32,
    /// Height of the image, pixels.
    pub height: u32,
    /// Size of the responses that were sent as evidence, bytes; 0 without a subscriber.
    pub evidence_bytes: u64,
    /// How long after the instant of the frame the picture was taken ([`FrameHeader`](crate::FrameHeader)), nanoseconds.
    pub skew_nanos: i64,
    /// Region that was searched.
    pub searched: Searched,
    /// Number of extra keypoints of a candidate, as many as all views of the deployment know together.
    pub n_keypoints: u32,
    /// The candidates: cells by the paper's method, by that of networks the score alone, with `joints` and `heats`.
    pub candidates: [PoseMessage; MAX_CANDIDATES],
    /// By the method of networks: where every joint of every candidate is seen best, pixels of the frame.
    pub joints: [[[f32; 2]; MAX_JOINTS]; MAX_CANDIDATES],
    /// Local scores of the parts of the first candidate.
    pub local: [LocalMessage; MAX_PARTS],
    /// Evidence of the picture about the direction in which the person of every candidate faces: `multiview::FrontEvidence`,
    /// `[towards the right of the picture, towards the camera]`; zeros where there is no evidence.
    pub front: [[f32; 2]; MAX_CANDIDATES],
    /// How sure the network is of every joint of every candidate, 0 to 1: 0 for one that is not seen; zeros of filters.
    pub heats: [[f32; MAX_JOINTS]; MAX_CANDIDATES],
    /// The extra keypoints of one candidate after the other, for as many candidates as there is room: `[column, row, standard
    /// deviation along one axis]`, pixels of the frame; a deviation of 0 for one that was not found.
    pub keypoints: [[f32; 3]; MAX_VIEW_KEYPOINTS],
}

impl Default for ViewPose {
    fn default() -> Self {
        Self::zeroed()
    }
}

/// The result of a pair of views under one assumption about facing.
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
    /// 1 if left and right of the second view are exchanged with respect to the first.
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
/// Where all views are solved at once, the message carries the part of the result about one view
/// and the first view with a result; the energies are then those of all views, and `view` of the
/// stamp is the index of the view minus 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PairPose.v3")]
#[repr(C)]
pub struct PairPose {
    /// The frame; `view` is the index of the pair.
    pub stamp: Stamp,
    /// When it was received and sent.
    pub timing: Timing,
    /// Says that there is a hypothesis, or why there is none.
    pub status: Status,
    /// Number of valid hypotheses.
    pub n_hypotheses: u32,
    /// The two views, ascending.
    pub views: [u32; 2],
    /// Same facing, then opposite facing; only one where facing is not decided.
    pub hypotheses: [PairHypothesis; 2],
    /// Bit `v` is set if the pose of view `v` arrived in time.
    pub views_present: u32,
    /// For either view: the age of its expected errors in frames, plus 1, so that 1 means this very
    /// frame; 0 without expected errors, in which case every part counts as usable.
    pub sigma_age: [u16; 2],
    /// For either view: the predicted distance of every part's centre from the truth, pixels of the
    /// frame; for as many parts as the poses have, and only if `sigma_age` is not 0.
    pub sigma_px: [[f32; MAX_PARTS]; 2],
}
