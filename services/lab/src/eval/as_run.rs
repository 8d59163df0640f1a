//! Evaluation of sequences as `parallax run` solves them: all steps of the network's method, from frame to frame.

use std::sync::Arc;

use crate::evaluation::Film;
use failure::{ExitKind, Failure, OrFail as _};
use fmp::Model;
use geometry::Camera;
use keypoints::Sides;
use pipeline::{
    Eyes, NetworkEstimator, NetworkEstimatorSettings, NetworkSettings, NetworkStep,
    SpaceStepSettings, ViewContent, ViewFrame, WhoSettings,
};
use posenetwork::{Detector, PoseNetwork};
use skeleton::PARSE14;
use statistics::score::Point;
use training::datasets::sequences::Sequence;

/// Opens the networks of a view.
pub trait OpenView {
    /// Opens the network that finds keypoints.
    ///
    /// # Errors
    ///
    /// Fails if the network cannot be read.
    fn network(&self) -> Result<PoseNetwork, Failure>;

    /// Opens the detector of people.
    ///
    /// # Errors
    ///
    /// Fails if the detector cannot be read.
    fn detector(&self) -> Result<Detector, Failure>;
}

/// Settings for solving sequences as `parallax run` does.
pub struct AsRun<'a> {
    /// Opens the networks of a view.
    pub open: &'a dyn OpenView,
    /// The model of parts, from which views are planned.
    pub model: Arc<Model>,
}

impl core::fmt::Debug for AsRun<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("AsRun").finish_non_exhaustive()
    }
}

impl AsRun<'_> {
    /// Returns the pipeline for a sequence. People are searched for in every frame, because the frames of a sequence can be far apart in
    /// time.
    ///
    /// # Errors
    ///
    /// Fails if a network cannot be read, or frames are too small.
    pub fn estimator(
        &self,
        sequence: &Sequence,
        cameras: &[Camera],
    ) -> Result<NetworkEstimator, Failure> {
        let (mut plans, mut steps, mut as_seen) = (Vec::new(), Vec::new(), false);
        for camera in cameras {
            let plan = pipeline::plan(&self.model, camera).or_fail(ExitKind::Input)?;
            let network = self.open.network()?;
            as_seen |= network.card().keypoints.sides == Sides::Seen;
            let eyes = Eyes::Network(Box::new(network), Box::new(self.open.detector()?));
            let settings = NetworkSettings {
                find_every: 1,
                find_every_of_several: 1,
                ..NetworkSettings::default()
            };
            steps.push(NetworkStep::new(eyes, plan.layout().image_size, settings));
            plans.push(plan);
        }
        let settings = NetworkEstimatorSettings {
            space: SpaceStepSettings::for_views(NetworkSettings::default().least_heat, as_seen),
            who: WhoSettings {
                as_seen,
                ..WhoSettings::default()
            },
            frame_rate_hz: sequence.frame_rate_hz,
            ..NetworkEstimatorSettings::default()
        };
        let up = sequence.rig.up_in_world();
        Ok(NetworkEstimator::new(&plans, steps, up, settings))
    }
}

/// Returns the joints of `skeleton::PARSE14` in a frame of a film.
///
/// * `index`: index of the frame, larger than in the previous call.
///
/// # Errors
///
/// Fails if the footage cannot be read, or the network fails.
pub fn joints(
    estimator: &mut NetworkEstimator,
    film: &mut Film,
    index: u64,
) -> Result<Vec<Option<Point>>, Failure> {
    let images = film.at(index).or_fail(ExitKind::Input)?;
    let view = |image| ViewFrame {
        content: ViewContent::Picture(image),
        skew_s: 0.0,
    };
    let frames: Vec<_> = images.into_iter().map(|image| image.map(view)).collect();
    let estimate = estimator.estimate(index, &frames).or_fail(ExitKind::Input)?;
    let Some(followed) = estimate.skeletons.first() else {
        return Ok(vec![None; PARSE14.joints.len()]);
    };
    let joints = followed.skeleton.joints.iter();
    Ok(joints.map(|joint| Some(joint.as_ref().ok()?.in_world.coords.into())).collect())
}
