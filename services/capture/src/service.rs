//! Sends the frames of one camera.

use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use runtime::Service;

use crate::camera::{Camera, Shot};
use crate::job::Job;
use crate::live_service;
use crate::supply::{Step, Supply};
use deployment::capture::Pace;

/// Sends the footage of one view, then the end of the stream.
///
/// A frame without a picture, or with a faulty one, is sent without pixels. Its status gives the cause
/// ([`messages::Status::CAMERA_FAULTS`]).
///
/// # Errors
///
/// Fails with [`ExitKind::Input`] if the footage cannot be opened, and with errors of the transport.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    if let Some(live) = &job.live {
        return live_service::run(service, job, live);
    }
    let is_live = job.pace == Pace::Realtime;
    let faults = job.faults.of_epoch(service.epoch());
    let footage = (&job.source, job.timeline.as_ref());
    let supply = Supply::open(footage, &faults, is_live, job.frozen_after);
    let mut supply = supply.or_fail(ExitKind::Input)?;
    service.health().set_total(supply.info().n_frames);
    let mut camera = Camera::open(service, job, &supply)?;
    let mut at = camera.resume(&mut supply);
    while !service.stop().is_requested() {
        at += camera.wait_until_due(&mut supply, at)?;
        if service.stop().is_requested() {
            break;
        }
        let (asked_at, index) = (now_nanos(), supply.index());
        let step = supply.step(asked_at);
        camera.log_trouble(index, step);
        match step {
            Step::Picture => {
                let rest = supply.rest_nanos(index);
                let shot = Shot {
                    captured_at: asked_at.saturating_add_signed(rest),
                    asked_at,
                    skew: rest.saturating_add(job.skew_nanos),
                };
                camera.send_frame(index, supply.pixels(), shot)?;
            }
            Step::Nothing(status) => camera.send_nothing(index, status)?,
            Step::End => return camera.end(at),
        }
        at += 1;
        camera.note(at);
    }
    Ok(())
}
