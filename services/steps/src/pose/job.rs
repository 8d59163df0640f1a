//! The settings of the process.

use core::time::Duration;

use deployment::Timeline;
use keypoints::files::SeenKeypoints;
use keypoints::keypointfiles::{KeypointFileError, KeypointSource};
use pipeline::{LookBudget, NetworkStep, ViewStep};

/// Keypoints that another program found in the footage of a view.
#[derive(Debug)]
pub struct Keypoints {
    /// Step that turns the keypoints into evidence.
    pub step: NetworkStep,
    /// Source of the keypoints.
    pub source: Source,
}

/// Keypoint files, mapped to frames of the pipeline.
#[derive(Debug)]
pub struct Source {
    /// The files.
    pub files: KeypointSource,
    /// For cameras with clocks of their own: the assignment of frames in the files to the frames of the run.
    pub timeline: Option<Timeline>,
    /// Mapping from pixels of the footage to pixels of the frame: `[[a, b, c], [d, e, f]]`.
    pub frame_from_source: [[f64; 3]; 2],
}

impl Source {
    /// Reads the people of a frame, in pixels of the frame. There are no people if no file has the frame.
    ///
    /// * `people`: replaced by the people of the frame.
    ///
    /// # Errors
    ///
    /// Fails if a file cannot be read; `people` is then empty.
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
    /// The filters of a model search the frames.
    Filters(Box<ViewStep>),
    /// A network finds keypoints in the frames.
    Network(Box<NetworkStep>),
    /// Keypoints from another program are read.
    Keypoints(Box<Keypoints>),
}

impl Step {
    /// Returns the width and height of the frames.
    pub(crate) fn size(&self) -> [usize; 2] {
        match self {
            Self::Filters(step) => step.layout().image_size,
            Self::Network(step) => step.size(),
            Self::Keypoints(keypoints) => keypoints.step.size(),
        }
    }
}

/// Limit for the runs of the network in one view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Looks {
    /// The network runs on every person in every frame.
    All,
    /// Number of runs per frame, on average.
    Fixed(f64),
    /// As many as the cores manage at the frame rate.
    Affordable(LookBudget),
}

/// The settings of the process of one view.
#[derive(Debug)]
pub struct Job {
    /// Index of the view.
    pub view: usize,
    /// The single-view step.
    pub step: Step,
    /// Number of extra keypoints per candidate.
    pub n_extras: usize,
    /// Number of processes that receive the candidates.
    pub n_pose_consumers: usize,
    /// Number of processes that receive the evidence.
    pub n_evidence_consumers: usize,
    /// First frame to use.
    pub start_frame: u64,
    /// Interval between used frames, in frames of the footage.
    pub frame_step: u64,
    /// Frame rate of the footage, if known. It limits how far a pose may have moved.
    pub frame_rate_hz: Option<f64>,
    /// For `Network`: largest gap between two frames over which people can be followed, in frames of the footage.
    pub most_apart: Option<f64>,
    /// Limit for the runs of the network.
    pub looks: Looks,
    /// Time that the process waits for receivers.
    pub patience: Duration,
}
