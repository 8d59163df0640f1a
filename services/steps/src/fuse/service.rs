//! Joins the poses of the views, solves this worker's pairs of views (or all views at once) from their evidence, and sends the poses.

use std::sync::Arc;

use crate::fuse::input::{Candidates, Input, expected_errors};
use crate::fuse::job::Job;
use crate::fuse::worker::Worker;
use failure::Failure;
use messages::{Sightings, topic};
use pipeline::Following;
use runtime::Service;
use stage::Stage;

/// Fuses every frame, until the footage of all views ends or a stop is requested.
///
/// # Errors
///
/// Fails with errors of the transport.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    let n_views = job.plans.len();
    let mut stage = Stage::new(service, job.patience);
    stage.skip_when_behind(job.frame_step);
    for (view, plan) in job.plans.iter().enumerate() {
        stage.view_input(&topic::sightings(view), view, |pose: &Sightings| {
            let candidates = wire::candidates_from_message(pose, plan.model(), plan.layout())?;
            Ok(Input::Candidates(Candidates {
                front: wire::front_from_message(pose, candidates.len())?,
                poses: candidates,
                skew_s: wire::skew_from_message(pose)?,
            }))
        })?;
    }
    for view in (0..n_views).filter(|_| job.has_quality) {
        let n_parts = job.plans[view].model().n_parts();
        let times = [job.quality_deadline, job.quality_max_age];
        stage.optional_input(&topic::view_quality(view), view, times, move |message| {
            expected_errors(message, n_parts).map(Input::Errors)
        })?;
    }
    let mut evidence = Vec::new();
    for view in 0..n_views {
        let is_needed = job.pairs.iter().any(|(_, views)| views.contains(&view));
        let held = is_needed.then(|| stage.hold_evidence(view, job.frame_step));
        evidence.push(held.transpose()?);
    }
    let worker = Worker {
        service,
        job,
        evidence,
        output: stage.output(&topic::pair_pose(job.worker), job.n_consumers)?,
    };
    // A pair may need one solution or many, but the work per pyramid level is always similar.
    let step = Arc::clone(&job.step);
    service.progress().follow(move || step.n_sweeps());
    let mut following = Following::new(job.follow);
    stage.run(|frame| worker.fuse(frame, &mut following))
}
