//! Task of the process.

use core::time::Duration;

use deployment::Timeline;
use keypoints::files::SeenKeypoints;
use keypoints::keypointfiles::{KeypointFileError, KeypointSource};
use pipeline::{NetworkStep, ViewStep};

/// Keypoints that another program found in the footage of a view.
#[derive(Debug)]
pub struct Keypoints {
    /// Step that makes evidence of them.
    pub step: NetworkStep,
    /// Where they are.
    pub source: Source,
}

/// Files of keypoints, as frames of the pipeline.
#[derive(Debug)]
pub struct Source {
    /// The files.
    pub files: KeypointSource,
    /// Which frame of them belongs to each common instant, where cameras have clocks of their own.
    pub timeline: Option<Timeline>,
    /// From pixels of the footage to pixels of the frame: `[[a, b, c], [d, e, f]]`.
    pub frame_from_source: [[f64; 3]; 2],
}

impl Source {
    /// Reads the people of a frame, pixels of the frame; nobody if no file has it.
    ///
    /// * `people`: replaced by them.
    ///
    /// # Errors
    ///
    /// A file cannot be read; `people` is empty then.
    pub fn read(
        &self,
        frame: u64,
        people: &mut Vec<SeenKeypoints>,
    ) -> Result<(), KeypointFileError> {
        let timeline = self.timeline.as_ref();
        let frame = timeline.map_or(frame, |timeline| timeline.frame(frame));
        self.files.of_frame(frame, people)?;
        let [[a, b, c], [d, e, f]] = self.frame_from_source;
        let found = people.iter_mut().flat_map(|person| &mut person.keypoints);
        for keypoint in found.flatten() {
            let [x, y] = keypoint.at;
            keypoint.at = [a * x + b * y + c, d * x + e * y + f];
        }
        Ok(())
    }
}

/// The single-view step.
#[derive(Debug)]
pub enum Step {
    /// By the filters of a model.
    Filters(Box<ViewStep>),
    /// By a network that finds keypoints.
    Network(Box<NetworkStep>),
    /// By keypoints that another program found.
    Keypoints(Box<Keypoints>),
}

impl Step {
    /// Width and height of the frames.
    pub(crate) fn size(&self) -> [usize; 2] {
        match self {
            Self::Filters(step) => step.layout().image_size,
            Self::Network(step) => step.size(),
            Self::Keypoints(keypoints) => keypoints.step.size(),
        }
    }
}

/// Task of the process of one view.
#[derive(Debug)]
pub struct Job {
    /// The view.
    pub view: usize,
    /// The single-view step.
    pub step: Step,
    /// Number of extra keypoints of a candidate.
    pub n_extras: usize,
    /// Processes that receive the candidates.
    pub n_pose_consumers: usize,
    /// Processes that receive the evidence.
    pub n_evidence_consumers: usize,
    /// First frame that is used.
    pub start_frame: u64,
    /// Distance between the frames used.
    pub frame_step: u64,
    /// Frame rate of the footage, if known; limits how far a pose may have moved.
    pub frame_rate_hz: Option<f64>,
    /// `Network`: most frames of the footage from one in which people are seen to the next one in which they can be followed.
    pub most_apart: Option<f64>,
    /// How long the process waits for receivers.
    pub patience: Duration,
}
