//! The loop: take the candidates of a frame, predict their errors, send them.

use core::time::Duration;
use std::sync::Arc;

use fmp::{Layout, LocalScore, Model, Pose};
use kernels::Rgb8View;
use messages::{FrameHeader, Stamp, Status, Timing, ViewPose, ViewQuality, topic};
use metrics::Passage;
use runtime::{
    ExitKind, Failure, OrFail as _, Publisher, Sample, Service, Waiter, Woken, now_nanos,
};
use viewquality::{Forecaster, Predictor, Seen};
use wire::WireError;

use crate::frames::Frames;

/// What one view's process has to do.
#[derive(Debug)]
pub struct Job {
    /// The view.
    pub view: usize,
    /// Where expected errors come from.
    pub source: Source,
    /// Pixels of the frame per pixel of the footage.
    pub frame_scale: f32,
    /// Distance between the frames used, at least 1.
    pub frame_step: u64,
    /// Processes that take the expected errors.
    pub n_consumers: usize,
    /// How long they are waited for.
    pub patience: Duration,
}

/// Where expected errors come from.
#[derive(Debug)]
pub enum Source {
    /// A table, in pixels of the footage.
    Table(Predictor),
    /// A network that looks at the frames.
    Network(Box<Looking>),
}

/// A network, and what it needs to know of the view.
#[derive(Debug)]
pub struct Looking {
    /// The network.
    pub forecaster: Forecaster,
    /// The model of the person.
    pub model: Arc<Model>,
    /// The pyramid of the frames.
    pub layout: Arc<Layout>,
}

/// Answers every message of one view, until the footage ends or it is told to stop.
///
/// # Errors
///
/// What the transport says.
pub fn run(service: &Service, job: &mut Job) -> Result<(), Failure> {
    let bus = service.bus();
    let mut waiter = bus.waiter();
    let poses = bus.subscriber::<ViewPose>(&topic::view_pose(job.view), &mut waiter)?;
    let mut frames = match &job.source {
        Source::Table(_) => None,
        Source::Network(_) => {
            let frames = bus.slice_subscriber(&topic::frame(job.view), &mut waiter)?;
            Some(Frames::new(frames, service, job.view, job.frame_step))
        }
    };
    let publisher = bus.publisher::<ViewQuality>(&topic::view_quality(job.view))?;
    publisher.wait_for_subscribers(job.n_consumers, service.patience_at_start(job.patience));
    while waiter.wait(Duration::from_millis(100))? != Woken::Stop {
        if let Some(frames) = &mut frames {
            frames.listen()?;
        }
        while let Some(pose) = poses.receive()? {
            let expected = wire::Expected {
                session: service.session(),
                view: job.view,
                now_nanos: now_nanos(),
            };
            if let Err(error) = expected.check(&pose.stamp, &pose.timing) {
                service
                    .health()
                    .refuse(error.refusal(), "view-pose", &error);
                continue;
            }
            if pose.status == Status::END {
                // Their sender is to wait for nobody who reads no more.
                drop(frames);
                return end(service, &publisher, &waiter, pose.stamp);
            }
            let received_at_nanos = now_nanos();
            service.health().received(1);
            service.progress().tick();
            let mut message = answer(service, job, &pose, frames.as_mut())?;
            message.stamp = Stamp {
                epoch: service.epoch(),
                ..pose.stamp
            };
            message.took_nanos = now_nanos() - received_at_nanos;
            let computing = message.took_nanos;
            message.timing = Timing {
                received_at_nanos,
                sent_at_nanos: now_nanos(),
            };
            publisher.send(&message)?;
            service.health().sent(pose.stamp.frame);
            let sent_at = message.timing.sent_at_nanos;
            service.health().passed(&Passage {
                waiting: Some(received_at_nanos.saturating_sub(pose.timing.sent_at_nanos)),
                computing,
                publishing: now_nanos() - sent_at,
                since_capture: Some(sent_at.saturating_sub(pose.stamp.captured_at_nanos)),
            });
        }
    }
    Ok(())
}

fn end(
    service: &Service,
    publisher: &Publisher<ViewQuality>,
    waiter: &Waiter,
    stamp: Stamp,
) -> Result<(), Failure> {
    let end = ViewQuality {
        stamp,
        status: Status::END,
        ..ViewQuality::default()
    };
    let say = || -> Result<(), Failure> {
        publisher.send(&end)?;
        Ok(())
    };
    say()?;
    service.health().finished();
    waiter.linger(|| publisher.n_connected(), say)
}

fn answer(
    service: &Service,
    job: &mut Job,
    pose: &ViewPose,
    frames: Option<&mut Frames<'_>>,
) -> Result<ViewQuality, Failure> {
    let frame = pose.stamp.frame;
    match (&mut job.source, frames) {
        (Source::Table(predictor), _) => {
            let sigma = predictor.sigma_px(frame);
            let sigma = sigma.map(|it| it.iter().map(|px| px * job.frame_scale).collect());
            let sigma: Option<Vec<f32>> = sigma;
            wire::sigma_to_message(sigma.as_deref()).or_fail(ExitKind::Run)
        }
        (Source::Network(looking), Some(frames)) => {
            frames.listen()?;
            frames.advance(frame)?;
            let read = candidates(looking, pose).map_err(|error| {
                service
                    .health()
                    .refuse(error.refusal(), "view-pose", &error);
            });
            let message = match read {
                Ok(read) => look(looking, read, (frame, frames.of(frame)), job.frame_scale),
                Err(()) => wire::sigma_to_message(None).or_fail(ExitKind::Run),
            };
            // What is done with goes back to the camera.
            frames.advance(frame + 1)?;
            message
        }
        (Source::Network(_), None) => wire::sigma_to_message(None).or_fail(ExitKind::Run),
    }
}

/// The candidates of a view, and how well the parts of the first one fit.
type Read = (Vec<Pose>, Vec<LocalScore>);

fn candidates(looking: &Looking, pose: &ViewPose) -> Result<Read, WireError> {
    let candidates = wire::candidates_from_message(pose, &looking.model, &looking.layout)?;
    let scores = wire::local_from_message(pose, looking.model.n_parts())?;
    Ok((candidates, scores))
}

/// Runs the network on the best candidate, on the frame where it lies in shared memory. What cannot be
/// predicted is said to be so, and why goes to the log: a view is worth more than its expected errors.
fn look(
    looking: &mut Looking,
    (candidates, scores): Read,
    (frame_number, frame): (u64, Option<&Sample<u8, FrameHeader>>),
    frame_scale: f32,
) -> Result<ViewQuality, Failure> {
    let (model, layout) = (&looking.model, &looking.layout);
    let nothing = || wire::sigma_to_message(None).or_fail(ExitKind::Run);
    if candidates.is_empty() {
        return nothing();
    }
    let Some(frame) = frame else {
        tracing::debug!(frame_number, "the frame is gone");
        return nothing();
    };
    let [width, height] = layout.image_size;
    let header = frame.header();
    let is_known = [header.width as usize, header.height as usize] == [width, height];
    let image = match Rgb8View::new(width, height, frame.payload()) {
        Ok(image) if is_known => image,
        _ => {
            tracing::warn!(frame_number, "a frame of another size");
            return nothing();
        }
    };
    let seen = Seen {
        image,
        on: (model, layout),
        candidates: &candidates,
        scores: &scores,
        frame_scale: f64::from(frame_scale),
    };
    let forecast = match looking.forecaster.run(&seen) {
        Ok(forecast) => forecast,
        Err(error) => {
            tracing::warn!(frame_number, %error, "no prediction");
            return nothing();
        }
    };
    let sigma = Some(forecast.sigma_px.as_slice());
    let mut message = wire::sigma_to_message(sigma).or_fail(ExitKind::Run)?;
    wire::tau_to_message(&mut message, &forecast.tau_px).or_fail(ExitKind::Run)?;
    message.network = looking.forecaster.network().fingerprint();
    message.tile = forecast.tile.rectangle().map(|it| it as f32);
    Ok(message)
}
