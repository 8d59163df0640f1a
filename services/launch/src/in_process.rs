//! The pipeline of a deployment in one process, for people found by networks. It executes the same steps as the separate processes, and
//! gives results that are equal bit for bit.

use failure::{ExitKind, Failure, OrFail as _};
use kernels::Rgb8View;
use keypoints::files::SeenKeypoints;
use pipeline::{
    NetworkEstimate, NetworkEstimator, NetworkEstimatorSettings, ViewContent, ViewFrame,
};
use steps::pose;

use crate::prepare::{Prepared, space_settings, who_settings};
use crate::process::{most_apart, view_step};
use crate::resolved::Resolved;

/// A frame of a view.
#[derive(Debug, Clone, Copy)]
pub struct SentFrame<'a> {
    /// Picture of the frame.
    pub image: Rgb8View<'a>,
    /// Time from the nominal time of the frame until the picture was taken, in nanoseconds.
    pub skew_nanos: i64,
}

/// The pipeline of a deployment in one process.
#[derive(Debug)]
pub struct InProcess {
    estimator: NetworkEstimator,
    /// Keypoints of each view; `None` for a view in which a network searches the pictures.
    keypoints: Vec<Option<pose::Source>>,
    start_frame: u64,
    frame_step: u64,
    n_frames: u64,
}

impl InProcess {
    /// Prepares the pipeline of a deployment whose people are found by networks or given as keypoints.
    ///
    /// # Errors
    ///
    /// Fails if an input cannot be read, or if the deployment uses filters to find people.
    pub fn new(resolved: &Resolved) -> Result<Self, Failure> {
        let deployment = &resolved.deployment;
        let prepared = Prepared::new(resolved)?;
        let plans = prepared.plans();
        let (mut steps, mut keypoints) = (Vec::new(), Vec::new());
        for view in 0..plans.len() {
            match view_step::of_view(resolved, &prepared, view)? {
                pose::Step::Network(step) => {
                    steps.push(*step);
                    keypoints.push(None);
                }
                pose::Step::Keypoints(it) => {
                    let pose::Keypoints { step, source } = *it;
                    steps.push(step);
                    keypoints.push(Some(source));
                }
                pose::Step::Filters(_) => {
                    let message =
                        "this deployment finds people with filters, but a network is needed here";
                    return Err(Failure::new(ExitKind::Config, message));
                }
            }
        }
        let settings = NetworkEstimatorSettings {
            who: who_settings(resolved, &prepared),
            space: space_settings(resolved, &prepared),
            frame_rate_hz: resolved.frame_rate_hz(),
            most_apart: most_apart(resolved),
            looks: deployment.network.looks,
        };
        Ok(Self {
            start_frame: deployment.capture.start_frame,
            frame_step: deployment.capture.frame_step.max(1),
            n_frames: 0,
            estimator: NetworkEstimator::new(&plans, steps, prepared.up_in_world, settings),
            keypoints,
        })
    }

    /// Computes the poses and 3D joints of the next frame.
    ///
    /// * `frames`: frames of the views, as the capture processes send them; `None` for a missing view.
    ///
    /// # Errors
    ///
    /// Fails if a network fails.
    pub fn estimate(
        &mut self,
        frames: &[Option<SentFrame<'_>>],
    ) -> Result<NetworkEstimate, Failure> {
        let frame = self.start_frame + self.n_frames * self.frame_step;
        self.n_frames += 1;
        let mut people: Vec<Vec<SeenKeypoints>> = Vec::new();
        for source in &self.keypoints {
            let mut found = Vec::new();
            if let Some(source) = source {
                source.read(frame, &mut found).or_fail(ExitKind::Input)?;
            }
            people.push(found);
        }
        let people: Vec<Vec<_>> = people
            .into_iter()
            .map(|found| found.into_iter().map(|person| person.keypoints).collect())
            .collect();
        let mut seen: Vec<Option<ViewFrame<'_>>> = Vec::new();
        for (view, sent) in frames.iter().enumerate() {
            seen.push(sent.as_ref().map(|sent| ViewFrame {
                content: match &self.keypoints[view] {
                    Some(_) => ViewContent::Keypoints(&people[view]),
                    None => ViewContent::Picture(sent.image),
                },
                skew_s: sent.skew_nanos as f64 * 1e-9,
            }));
        }
        self.estimator.estimate(frame, &seen).or_fail(ExitKind::Run)
    }
}
