//! The poses of one view after fusion.

use fmp::Pose;
use multiview::{Exchanges, FusedPose, ViewPlan, average, is_exchanged};

/// One view after fusion.
#[derive(Debug, Clone, PartialEq)]
pub struct FusedView {
    /// The pose combined from the poses of the view's pairs; parts are named by the person's left and right. A part without a position is
    /// NaN.
    pub pose: FusedPose,
    /// True if the view sees the person from behind.
    pub exchanged: bool,
    /// Mean cell size of the levels on which the view was fused, in pixels of the frame.
    pub cell_px: f64,
    /// Score of the view's own best candidate.
    pub single_score: f64,
}

/// A pose of one view; parts are named by the person's left and right.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub(crate) energy: f64,
    pub(crate) cell_px: f64,
    pub(crate) centres_px: Vec<[f64; 2]>,
}

impl Candidate {
    /// Creates the candidate of a pose.
    ///
    /// * `mirror`: permutation that swaps left and right parts, if the view sees the person from behind.
    pub(crate) fn of_pose(
        pose: &Pose,
        energy: f64,
        plan: &ViewPlan,
        mirror: Option<&[usize]>,
    ) -> Self {
        Self {
            energy,
            cell_px: plan.scale(usize::from(pose.level)),
            centres_px: (0..pose.parts.len())
                .map(|part| plan.centre(pose, mirror.map_or(part, |mirror| mirror[part])))
                .collect(),
        }
    }

    /// Returns the fused view that has only this pose, unchanged by any pair.
    pub(crate) fn alone(self, exchanged: bool) -> FusedView {
        FusedView {
            pose: FusedPose {
                centres_px: self.centres_px,
                n_pairs: 0,
                energy: self.energy,
            },
            exchanged,
            cell_px: self.cell_px,
            single_score: self.energy,
        }
    }
}

/// The poses of one view.
#[derive(Debug, Clone)]
pub(crate) struct Candidates {
    /// The poses from the view's pairs, or the view's own pose if the view is not in a pair; never empty.
    pub(crate) poses: Vec<Candidate>,
    /// Number of poses that result from pairs.
    pub(crate) n_pairs: usize,
    /// Score of the view's own best candidate.
    pub(crate) single_score: f64,
}

/// Computes the mean pose of every view.
pub(crate) fn fuse(views: &[Option<Candidates>], exchanged: Exchanges) -> Vec<Option<FusedView>> {
    let fuse_view = |(view, candidates): (usize, &Option<Candidates>)| {
        let candidates = candidates.as_ref()?;
        let poses: Vec<_> = candidates
            .poses
            .iter()
            .map(|pose| (pose.energy, pose.centres_px.as_slice()))
            .collect();
        let n = poses.len() as f64;
        Some(FusedView {
            pose: FusedPose {
                n_pairs: candidates.n_pairs,
                ..average(&poses)?
            },
            exchanged: is_exchanged(exchanged, view),
            cell_px: candidates.poses.iter().map(|pose| pose.cell_px).sum::<f64>() / n,
            single_score: candidates.single_score,
        })
    };
    views.iter().enumerate().map(fuse_view).collect()
}
