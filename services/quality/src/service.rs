//! The loop: take the candidates of a frame, look its expected errors up, send them.

use core::time::Duration;

use messages::{Stamp, Status, Timing, ViewPose, ViewQuality, topic};
use runtime::{ExitKind, Failure, OrFail as _, Service, Woken, now_nanos};
use viewquality::Predictor;

/// What one view's process has to do.
#[derive(Debug)]
pub struct Job {
    /// The view.
    pub view: usize,
    /// Knows the expected errors, pixels of the footage.
    pub predictor: Predictor,
    /// Pixels of the frame per pixel of the footage.
    pub frame_scale: f32,
    /// Processes that take the expected errors.
    pub n_consumers: usize,
    /// How long they are waited for.
    pub patience: Duration,
}

/// Answers every message of one view, until the footage ends or it is told to stop.
///
/// # Errors
///
/// What the transport says.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    let bus = service.bus();
    let mut waiter = bus.waiter();
    let poses = bus.subscriber::<ViewPose>(&topic::view_pose(job.view), &mut waiter)?;
    let publisher = bus.publisher::<ViewQuality>(&topic::view_quality(job.view))?;
    publisher.wait_for_subscribers(job.n_consumers, service.patience_at_start(job.patience));
    while waiter.wait(Duration::from_millis(100))? != Woken::Stop {
        while let Some(pose) = poses.receive()? {
            if pose.stamp.session != service.session() {
                continue;
            }
            if pose.status == Status::END {
                let end = ViewQuality {
                    stamp: pose.stamp,
                    status: Status::END,
                    ..ViewQuality::default()
                };
                let say = || -> Result<(), Failure> {
                    publisher.send(&end)?;
                    Ok(())
                };
                say()?;
                service.health().finished();
                return waiter.linger(|| publisher.n_connected(), say);
            }
            let received_at_nanos = now_nanos();
            service.health().received(1);
            let mut message = answer(job, pose.stamp.frame).or_fail(ExitKind::Run)?;
            message.stamp = Stamp {
                epoch: service.epoch(),
                ..pose.stamp
            };
            message.timing = Timing {
                received_at_nanos,
                sent_at_nanos: now_nanos(),
            };
            publisher.send(&message)?;
            service.health().sent(pose.stamp.frame);
        }
    }
    Ok(())
}

fn answer(job: &Job, frame: u64) -> Result<ViewQuality, wire::WireError> {
    let sigma: Option<Vec<f32>> = job
        .predictor
        .sigma_px(frame)
        .map(|sigma| sigma.iter().map(|px| px * job.frame_scale).collect());
    wire::sigma_to_message(sigma.as_deref())
}
