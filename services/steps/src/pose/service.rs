//! Opens the topics of a view, and searches its frames.

use failure::Failure;
use messages::topic;
use runtime::Service;
use stage::{Range, Stage};

use crate::pose::job::{Job, Step};
use crate::pose::memory::{Memory, NetworkState};
use crate::pose::view::View;

/// Searches every frame of one view, until the footage ends or a stop is requested.
///
/// # Errors
///
/// Fails with errors of the transport.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    let mut stage = Stage::new(service, job.patience);
    let view = View {
        service,
        job,
        poses: stage.view_output(&topic::sightings(job.view), job.n_pose_consumers)?,
        evidence: stage.bulk_output(&topic::evidence(job.view), job.n_evidence_consumers)?,
    };
    let mut memory = match &job.step {
        Step::Filters(step) => Memory::Filters(step.tracker(), Vec::new()),
        Step::Network(_) => Memory::Network(Box::new(NetworkState::new(job.looks))),
        Step::Keypoints(_) => Memory::Keypoints(Box::default()),
    };
    let range = Range {
        start: job.start_frame,
        step: job.frame_step,
    };
    stage.run_stream(job.view, range, |frame| view.process(frame, &mut memory))
}
