//! Poses in one view and in pairs of views.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_CANDIDATES, MAX_PARTS, Stamp, Status, Timing};

/// One pose: `fmp::Pose`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PoseMessage.v1")]
#[repr(C)]
pub struct PoseMessage {
    /// Score of the pose.
    pub score: f32,
    /// Level of the pyramid, from 0.
    pub level: u16,
    /// How many entries of the arrays count.
    pub n_parts: u16,
    /// Column of every part, response cells.
    pub x: [u16; MAX_PARTS],
    /// Row of every part, response cells.
    pub y: [u16; MAX_PARTS],
    /// Type of every part, from 0.
    pub mixture: [u8; MAX_PARTS],
}

/// How well one part of the best candidate fits where it lies: `fmp::LocalScore`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("LocalMessage.v1")]
#[repr(C)]
pub struct LocalMessage {
    /// Response of the part's filter.
    pub response: f32,
    /// The response less the mean response around.
    pub contrast: f32,
    /// The response less the best of the part's other types.
    pub margin: f32,
}

/// How much of the image and of its pyramid was searched for poses.
///
/// A transparent number rather than an enum: whatever bytes arrive, reading them is defined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Searched.v1")]
#[repr(C)]
pub struct Searched(pub u32);

impl Searched {
    /// All of it.
    pub const FULL: Self = Self(0);
    /// What lies near the last pose.
    pub const TRACKED: Self = Self(1);

    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::FULL => "full",
            Self::TRACKED => "tracked",
            Self(_) => "unknown",
        }
    }
}

/// The single-view answer: distinct candidates, best first.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("ViewPose.v3")]
#[repr(C)]
pub struct ViewPose {
    /// Which frame of which view.
    pub stamp: Stamp,
    /// When.
    pub timing: Timing,
    /// Whether there is a candidate.
    pub status: Status,
    /// How many candidates count.
    pub n_candidates: u32,
    /// Width of the image, pixels.
    pub width: u32,
    /// Height of the image, pixels.
    pub height: u32,
    /// Response values that were handed on as evidence, bytes; 0 where nobody wanted any.
    pub evidence_bytes: u64,
    /// How much of the image was searched.
    pub searched: Searched,
    /// Keeps the layout free of padding.
    pub reserved: u32,
    /// The candidates.
    pub candidates: [PoseMessage; MAX_CANDIDATES],
    /// Of the parts of the first.
    pub local: [LocalMessage; MAX_PARTS],
}

/// What a pair of views agreed on under one assumption about which way the person faces.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PairHypothesis.v1")]
#[repr(C)]
pub struct PairHypothesis {
    /// Joint energy (eq. 3) at the end.
    pub energy: f64,
    /// Single-view solutions that were computed.
    pub n_iterations: u32,
    /// 1 if nothing moved any more at the end, 0 if the cap on iterations ended it.
    pub converged: u32,
    /// 1 if left and right of the second view are exchanged with respect to the first.
    pub exchanged: u32,
    /// The candidate of either view that the pair started from.
    pub start: [u8; 2],
    /// Keeps the layout free of padding.
    pub reserved: [u8; 2],
    /// Bit `i` is set if the consistency terms of part `i` of the first view were switched on.
    pub active_parts: u64,
    /// The pose in the first and in the second view.
    pub poses: [PoseMessage; 2],
}

/// The answer of one pair of views.
///
/// Where all views are solved at once, the part of their answer that is about one view and the first view that
/// answered: the energies are those of all views, and `view` of the stamp is the view less 1.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PairPose.v3")]
#[repr(C)]
pub struct PairPose {
    /// Which frame; `view` is the index of the pair.
    pub stamp: Stamp,
    /// When.
    pub timing: Timing,
    /// Whether there is a hypothesis.
    pub status: Status,
    /// How many hypotheses count.
    pub n_hypotheses: u32,
    /// The two views, ascending.
    pub views: [u32; 2],
    /// Same facing, then opposite facing; one only where facing is not asked for.
    pub hypotheses: [PairHypothesis; 2],
    /// Bit `v` is set if view `v` delivered a pose for this frame in time.
    pub views_present: u32,
    /// Of either view: how many frames ago its expected errors were predicted, plus 1: 1 of this very
    /// frame; 0 where there were none, and every part counted as usable.
    pub sigma_age: [u16; 2],
    /// Of either view: the expected distance of every part's centre from the truth, pixels of the frame,
    /// as it was predicted; for as many parts as the poses have, and only where there is an age.
    pub sigma_px: [[f32; MAX_PARTS]; 2],
}
