//! The final result: the people of a frame, each with its joints in the world and its fused pose in every view.

use bytemuck::Zeroable as _;
use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_JOINTS, MAX_KEYPOINTS, MAX_PARTS, MAX_PEOPLE, MAX_VIEWS, Stamp, Status, Timing};

/// One joint in the world.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Joint3d.v1")]
#[repr(C)]
pub struct Joint3d {
    /// Position in the world frame of the rig, metres.
    pub in_world: [f64; 3],
    /// Covariance `[xx, xy, xz, yy, yz, zz]`, metres^2.
    pub covariance: [f64; 6],
    /// Root mean square distance of the joint's reprojections from the observations that were used,
    /// pixels.
    pub reprojection_px: f64,
    /// Bit `v` is set if view `v` was used.
    pub views_used: u32,
    /// Says that there is a position, or why there is none.
    pub status: Status,
}

/// The pose of one view after fusion: the mean over its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("FusedView.v1")]
#[repr(C)]
pub struct FusedView {
    /// Sum of the joint energies of the pairs that were averaged.
    pub energy: f64,
    /// Pairs that were averaged; 0 if the pose is the view's own, or if there is none.
    pub n_pairs: u32,
    /// Says that there is a pose, or why there is none.
    pub status: Status,
    /// 1 if the view sees the person from behind, and left and right have been exchanged.
    pub exchanged: u32,
    /// Number of valid centres.
    pub n_parts: u32,
    /// Centre of every anatomical part, pixels of the frame.
    pub centres_px: [[f64; 2]; MAX_PARTS],
    /// Score of the view's best single-view candidate.
    pub single_score: f64,
}

/// Certainty of left and right of a skeleton. A transparent number, as [`Status`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Sides.v1")]
#[repr(C)]
pub struct Sides(pub u32);

impl Sides {
    /// Nothing was decided: left and right are those of the pictures.
    pub const AS_SEEN: Self = Self(0);
    /// They are decided.
    pub const SURE: Self = Self(1);
    /// They are decided, but too little speaks for it.
    pub const UNSURE: Self = Self(2);

    /// The name for people and files.
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

/// Which poses the skeleton was triangulated from. A transparent number, as [`Status`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("Kept.v1")]
#[repr(C)]
pub struct Kept(pub u32);

impl Kept {
    /// Those that fusion solved for.
    pub const SOLVED: Self = Self(0);
    /// The single-view poses that fusion started from: they agree better.
    pub const START: Self = Self(1);

    /// The name for people and files.
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
    /// Identity within the run, from 1, as [`PersonMessage::id`](crate::PersonMessage::id); 1 by the paper's method, which names nobody.
    pub id: u64,
    /// State of the person: [`Status::OK`] with a skeleton, else why there is none.
    pub status: Status,
    /// Number of valid joints.
    pub n_joints: u32,
    /// Number of valid extra keypoints.
    pub n_keypoints: u32,
    /// Number of valid views.
    pub n_views: u32,
    /// Bit `v` is set if any joint uses view `v`.
    pub views_used: u32,
    /// Number of pairs of views with a part in the skeleton.
    pub n_pairs: u32,
    /// Certainty of left and right, by the margin of the decision.
    pub sides: Sides,
    /// Poses from which the skeleton was triangulated.
    pub kept: Kept,
    /// How certain it is which views see the person from the same side: energy of the chosen assignment
    /// minus that of the best other one.
    pub facing_margin: f64,
    /// How certain it is that left and right are not exchanged in all views: log-odds, nats.
    pub sides_margin: f64,
    /// Height of the person standing upright, by the lengths of the bones, metres; 0 if it is not known.
    pub stature_m: f64,
    /// Root mean square deviation of the bones' lengths from those of people, standard deviations.
    pub body_deviation: f64,
    /// The joints.
    pub joints: [Joint3d; MAX_JOINTS],
    /// The views.
    pub views: [FusedView; MAX_VIEWS],
    /// Keypoints that networks name beside the joints, as the deployment numbers them; nothing holds them together.
    pub keypoints: [Joint3d; MAX_KEYPOINTS],
}

impl SkeletonMessage {
    /// The valid joints, at most as many as fit.
    #[must_use]
    pub fn listed_joints(&self) -> &[Joint3d] {
        &self.joints[..(self.n_joints as usize).min(MAX_JOINTS)]
    }

    /// The valid extra keypoints, at most as many as fit.
    #[must_use]
    pub fn listed_keypoints(&self) -> &[Joint3d] {
        &self.keypoints[..(self.n_keypoints as usize).min(MAX_KEYPOINTS)]
    }

    /// The valid views, at most as many as fit.
    #[must_use]
    pub fn listed_views(&self) -> &[FusedView] {
        &self.views[..(self.n_views as usize).min(MAX_VIEWS)]
    }
}

/// The skeletons of one frame, that of the person who is followed first.
///
/// The count stands right before the list, so that what is in use is one piece of memory: a recording holds that and no more.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, Pod, Zeroable)]
#[type_name("Skeletons.v1")]
#[repr(C)]
pub struct Skeletons {
    /// The frame; `view` is 0.
    pub stamp: Stamp,
    /// When it was received and sent.
    pub timing: Timing,
    /// [`Status::OK`] if any person has a skeleton, else why nobody has.
    pub status: Status,
    /// Bit `v` is set if what view `v` found arrived in time.
    pub views_present: u32,
    /// Number of people that several views agree on, whether or not they are in the list; 0 if it was not counted.
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
    /// The valid people, at most as many as fit.
    #[must_use]
    pub fn listed(&self) -> &[SkeletonMessage] {
        &self.people[..(self.n_people as usize).min(MAX_PEOPLE)]
    }

    /// The followed person; `None` if there is nobody.
    #[must_use]
    pub fn followed(&self) -> Option<&SkeletonMessage> {
        self.listed().first()
    }
}
