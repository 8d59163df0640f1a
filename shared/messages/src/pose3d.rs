//! The final result: joints in the world, and the fused pose of every view.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_JOINTS, MAX_PARTS, MAX_VIEWS, Stamp, Status, Timing};

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
    /// Whether there is a position.
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
    /// Whether there is a pose.
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

/// The skeleton of one frame.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, Pod, Zeroable)]
#[type_name("Pose3d.v1")]
#[repr(C)]
pub struct Pose3d {
    /// The frame; `view` is 0.
    pub stamp: Stamp,
    /// When it was received and sent.
    pub timing: Timing,
    /// Whether there is a skeleton.
    pub status: Status,
    /// Number of valid joints.
    pub n_joints: u32,
    /// Number of valid views.
    pub n_views: u32,
    /// Bit `v` is set if the pose of view `v` arrived in time.
    pub views_present: u32,
    /// Bit `v` is set if any joint uses view `v`.
    pub views_used: u32,
    /// Number of pairs with a result.
    pub n_pairs: u32,
    /// How certain the decision about left and right is: energy of the chosen assignment minus that
    /// of the best other one.
    pub facing_margin: f64,
    /// The joints.
    pub joints: [Joint3d; MAX_JOINTS],
    /// The views.
    pub views: [FusedView; MAX_VIEWS],
}
