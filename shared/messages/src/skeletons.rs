//! The final result: the people of a frame, each with joints in the world and a fused pose in every view.

use bytemuck::Zeroable as _;
use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_JOINTS, MAX_KEYPOINTS, MAX_PARTS, MAX_PEOPLE, MAX_VIEWS, Stamp, Status, Timing};

/// One joint in the world.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Joint3d.v1")]
#[repr(C)]
pub struct Joint3d {
    /// Position in the world frame of the rig, in metres.
    pub in_world: [f64; 3],
    /// Covariance `[xx, xy, xz, yy, yz, zz]`, in square metres.
    pub covariance: [f64; 6],
    /// Root mean square distance of the joint's reprojections from the observations that were used, in pixels.
    pub reprojection_px: f64,
    /// Bit `v` is set if view `v` was used.
    pub views_used: u32,
    /// States whether there is a position and, if not, why.
    pub status: Status,
}

/// The pose of one view after fusion: the mean over its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("FusedView.v1")]
#[repr(C)]
pub struct FusedView {
    /// Sum of the joint energies of the pairs that were averaged.
    pub energy: f64,
    /// Number of pairs that were averaged; 0 if the pose is the view's own, or if there is no pose.
    pub n_pairs: u32,
    /// States whether there is a pose and, if not, why.
    pub status: Status,
    /// 1 if the view sees the person from behind, and left and right have been swapped.
    pub exchanged: u32,
    /// Number of valid centres.
    pub n_parts: u32,
    /// Centre of every part, named by the person's left and right, in pixels of the frame; NaN if its position is unknown.
    pub centres_px: [[f64; 2]; MAX_PARTS],
    /// Score of the view's best single-view candidate.
    pub single_score: f64,
}

/// How certain left and right of a skeleton are. A transparent number, like [`Status`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Sides.v1")]
#[repr(C)]
pub struct Sides(pub u32);

impl Sides {
    /// Left and right were not decided: they are named as they appear in the pictures.
    pub const AS_SEEN: Self = Self(0);
    /// Left and right were decided, and are certain.
    pub const SURE: Self = Self(1);
    /// Left and right were decided, but on too little evidence.
    pub const UNSURE: Self = Self(2);

    /// Returns the name for messages to users and for files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AS_SEEN => "as seen",
            Self::SURE => "sure",
            Self::UNSURE => "unsure",
            Self(_) => "unknown",
        }
    }
}

/// Poses from which the skeleton was triangulated. A transparent number, like [`Status`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Kept.v1")]
#[repr(C)]
pub struct Kept(pub u32);

impl Kept {
    /// The poses that fusion solved for.
    pub const SOLVED: Self = Self(0);
    /// The single-view poses from which fusion started, because they agree better.
    pub const START: Self = Self(1);

    /// Returns the name for messages to users and for files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SOLVED => "solved",
            Self::START => "start",
            Self(_) => "unknown",
        }
    }
}

/// The skeleton of one person.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, Pod, Zeroable)]
#[type_name("SkeletonMessage.v1")]
#[repr(C)]
pub struct SkeletonMessage {
    /// The person's id within the run, counted from 1, as in [`PersonMessage::id`](crate::PersonMessage::id). Always 1 with the paper's
    /// method, which does not identify people.
    pub id: u64,
    /// [`Status::OK`] if the person has a skeleton, otherwise the reason why not.
    pub status: Status,
    /// Number of valid joints.
    pub n_joints: u32,
    /// Number of valid extra keypoints.
    pub n_keypoints: u32,
    /// Number of valid views.
    pub n_views: u32,
    /// Bit `v` is set if any joint uses view `v`.
    pub views_used: u32,
    /// Number of pairs of views that contributed to the skeleton.
    pub n_pairs: u32,
    /// How certain left and right are, from the margin of the decision.
    pub sides: Sides,
    /// Poses from which the skeleton was triangulated.
    pub kept: Kept,
    /// How certain it is which views see the person from the same side: energy of the chosen assignment minus that of the best other
    /// assignment.
    pub facing_margin: f64,
    /// How certain it is that left and right are not swapped in all views: log-odds, in nats.
    pub sides_margin: f64,
    /// Height of the person when standing upright, from the lengths of the bones, in metres; 0 if it is not known.
    pub stature_m: f64,
    /// Root mean square deviation of the bone lengths from the bone lengths of real people, in standard deviations.
    pub body_deviation: f64,
    /// The joints of the person.
    pub joints: [Joint3d; MAX_JOINTS],
    /// The fused pose in every view.
    pub views: [FusedView; MAX_VIEWS],
    /// Extra keypoints of networks, in the numbering of the deployment. No bones connect them.
    pub keypoints: [Joint3d; MAX_KEYPOINTS],
}

impl SkeletonMessage {
    /// Returns the valid joints, at most as many as fit.
    #[must_use]
    pub fn listed_joints(&self) -> &[Joint3d] {
        &self.joints[..(self.n_joints as usize).min(MAX_JOINTS)]
    }

    /// Returns the valid extra keypoints, at most as many as fit.
    #[must_use]
    pub fn listed_keypoints(&self) -> &[Joint3d] {
        &self.keypoints[..(self.n_keypoints as usize).min(MAX_KEYPOINTS)]
    }

    /// Returns the valid views, at most as many as fit.
    #[must_use]
    pub fn listed_views(&self) -> &[FusedView] {
        &self.views[..(self.n_views as usize).min(MAX_VIEWS)]
    }
}

/// The skeletons of one frame. The followed person comes first.
///
/// The count is stored directly before the list, so that the used part is one block of memory. Only this block is written to a recording.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, Pod, Zeroable)]
#[type_name("Skeletons.v1")]
#[repr(C)]
pub struct Skeletons {
    /// Identity of the frame; `view` is 0.
    pub stamp: Stamp,
    /// Times at which the last input arrived and the message was sent.
    pub timing: Timing,
    /// [`Status::OK`] if any person has a skeleton, otherwise the reason why not.
    pub status: Status,
    /// Bit `v` is set if the result of view `v` arrived in time.
    pub views_present: u32,
    /// Number of people on whom several views agree, including people who are not in the list; 0 if they were not counted.
    pub n_seen: u32,
    /// Number of valid people.
    pub n_people: u32,
    /// The people.
    pub people: [SkeletonMessage; MAX_PEOPLE],
}

impl Default for Skeletons {
    fn default() -> Self {
        Self::zeroed()
    }
}

impl Default for SkeletonMessage {
    fn default() -> Self {
        Self::zeroed()
    }
}

impl Skeletons {
    /// Returns the valid people, at most as many as fit.
    #[must_use]
    pub fn listed(&self) -> &[SkeletonMessage] {
        &self.people[..(self.n_people as usize).min(MAX_PEOPLE)]
    }

    /// Returns the followed person; `None` if there is no person.
    #[must_use]
    pub fn followed(&self) -> Option<&SkeletonMessage> {
        self.listed().first()
    }
}
