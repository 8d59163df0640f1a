//! How far the results can be trusted: what they themselves tell, frame by frame.

use std::collections::BTreeMap;

use messages::{Joint3d, Pose3d, Sides, Status};
use runfiles::{Doubt, Trust};

use crate::height::height_px;

/// Steps in which deviations of bodies are counted, standard deviations.
const STEP: f64 = 0.05;

/// Counts what speaks for and against the results; warns once of each reason not to trust them.
#[derive(Debug, Default)]
pub(crate) struct Trusted {
    frames: u64,
    n_implausible: u64,
    n_decided: u64,
    n_unsure: u64,
    n_joints: u64,
    n_joints_implausible: u64,
    /// How many bodies, by their deviation in [`STEP`]s.
    deviations: BTreeMap<u32, u64>,
    /// Sum of the squared shares of the person's height, and their number.
    squared: (f64, u64),
    warned: Vec<Doubt>,
}

impl Trusted {
    /// Adds a result.
    pub(crate) fn add(&mut self, pose: &Pose3d) {
        let is_nobody = pose.status == Status::IMPLAUSIBLE;
        let is_body = pose.status == Status::OK && pose.stature_m > 0.0;
        // Skeletons of something else than people are not judged.
        if !is_body && !is_nobody {
            return;
        }
        self.frames += 1;
        self.n_implausible += u64::from(is_nobody);
        if !is_nobody {
            self.skeleton(pose);
        }
        for doubt in self.trust().doubts() {
            if !self.warned.iter().any(|it| it.is_like(&doubt)) {
                tracing::warn!("the results may be wrong: {doubt}");
                self.warned.push(doubt);
            }
        }
    }

    fn skeleton(&mut self, pose: &Pose3d) {
        self.n_decided += u64::from(pose.sides != Sides::AS_SEEN);
        self.n_unsure += u64::from(pose.sides == Sides::UNSURE);
        if pose.body_deviation.is_finite() {
            let step = (pose.body_deviation / STEP).round() as u32;
            *self.deviations.entry(step).or_default() += 1;
        }
        let height_px = mean_height_px(pose);
        let joints: &[Joint3d] = &pose.joints[..(pose.n_joints as usize).min(pose.joints.len())];
        for joint in joints {
            self.n_joints += 1;
            self.n_joints_implausible += u64::from(joint.status == Status::IMPLAUSIBLE);
            if let Some(height_px) = height_px.filter(|_| joint.status == Status::OK)
                && joint.reprojection_px.is_finite()
            {
                self.squared.0 += (joint.reprojection_px / height_px).powi(2);
                self.squared.1 += 1;
            }
        }
    }

    /// What is known so far.
    pub(crate) fn trust(&self) -> Trust {
        let share = |n: u64, of: u64| n as f64 / of.max(1) as f64;
        let (sum, n) = self.squared;
        let half = self.deviations.values().sum::<u64>().div_ceil(2);
        let mut counted = 0;
        let median = self.deviations.iter().find(|it| {
            counted += it.1;
            counted >= half
        });
        Trust {
            body_deviation: median.map(|it| f64::from(*it.0) * STEP),
            frames: self.frames,
            implausible: share(self.n_implausible, self.frames),
            joints_implausible: share(self.n_joints_implausible, self.n_joints),
            reprojection: (n > 0).then(|| (sum / n as f64).sqrt()),
            sides_unsure: share(self.n_unsure, self.n_decided),
        }
    }
}

/// The mean height of the person in the views that were used, pixels of their frames.
fn mean_height_px(pose: &Pose3d) -> Option<f64> {
    let views = pose.views.iter().take(pose.n_views as usize).enumerate();
    let used = views.filter(|(view, _)| pose.views_used >> view & 1 == 1);
    let heights: Vec<f64> = used.filter_map(|(_, fused)| height_px(fused)).collect();
    let mean = heights.iter().sum::<f64>() / heights.len().max(1) as f64;
    (mean > 0.0).then_some(mean)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;

    fn result(sides: Sides) -> Pose3d {
        let mut pose = Pose3d::zeroed();
        pose.status = Status::OK;
        pose.n_joints = 2;
        pose.n_views = 1;
        pose.views_used = 1;
        pose.sides = sides;
        pose.stature_m = 1.7;
        pose.body_deviation = 0.8;
        pose.views[0].status = Status::OK;
        pose.views[0].n_parts = 2;
        pose.views[0].centres_px[1] = [0.0, 200.0];
        pose.joints[0].reprojection_px = 4.0;
        pose.joints[1].status = Status::IMPLAUSIBLE;
        pose
    }

    #[test]
    fn shares_are_of_what_was_found() {
        let mut trusted = Trusted::default();
        trusted.add(&result(Sides::SURE));
        trusted.add(&result(Sides::UNSURE));
        let mut nobody = result(Sides::SURE);
        nobody.status = Status::IMPLAUSIBLE;
        trusted.add(&nobody);
        let mut nothing = result(Sides::SURE);
        nothing.status = Status::TOO_FEW_VIEWS;
        trusted.add(&nothing);
        let got = trusted.trust();
        assert_eq!((got.frames, got.sides_unsure), (3, 0.5));
        assert_eq!((got.implausible, got.joints_implausible), (1.0 / 3.0, 0.5));
        assert!((got.reprojection.unwrap() - 0.02).abs() < 1e-9);
        assert!((got.body_deviation.unwrap() - 0.8).abs() < 1e-9);
    }
}
