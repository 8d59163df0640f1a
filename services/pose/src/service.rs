//! The loop: take a frame, write the responses into shared memory, send candidates and evidence.

use core::time::Duration;

use kernels::Rgb8View;
use messages::{EvidenceHeader, FrameHeader, Stamp, Status, Timing, ViewPose, topic};
use pipeline::{ViewEstimate, ViewStep};
use runtime::{
    Delivery, ExitKind, Failure, Loan, OrFail as _, Publisher, Sample, Service, SlicePublisher,
    Waiter, Woken, now_nanos,
};

use crate::intake::Intake;

/// What one view's process has to do.
#[derive(Debug)]
pub struct Job {
    /// The view.
    pub view: usize,
    /// The single-view step.
    pub step: ViewStep,
    /// Processes that take the candidates.
    pub n_pose_consumers: usize,
    /// Processes that take the evidence.
    pub n_evidence_consumers: usize,
    /// First frame that is used.
    pub start_frame: u64,
    /// Distance between the frames used.
    pub frame_step: u64,
    /// How long they are waited for.
    pub patience: Duration,
}

/// Answers every frame of one view, until the footage ends or it is told to stop.
///
/// # Errors
///
/// What the transport says.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    let bus = service.bus();
    let mut waiter = bus.waiter();
    let frames = bus.slice_subscriber::<u8, FrameHeader>(&topic::frame(job.view), &mut waiter)?;
    let view = View {
        service,
        job,
        poses: bus.publisher(&topic::view_pose(job.view))?,
        evidence: bus.slice_publisher(&topic::evidence(job.view))?,
    };
    let patience = service.patience_at_start(job.patience);
    let n = view
        .poses
        .wait_for_subscribers(job.n_pose_consumers, patience);
    tracing::info!(n, expected = job.n_pose_consumers, "candidates are awaited");
    let n = view
        .evidence
        .wait_for_subscribers(job.n_evidence_consumers, patience);
    tracing::info!(
        n,
        expected = job.n_evidence_consumers,
        "evidence is awaited, begins"
    );
    let frame_range = [job.start_frame, job.frame_step];
    let mut intake = Intake::new(service.delivery(), frame_range, service.epoch());
    let mut spare = Vec::new();
    loop {
        if waiter.wait(Duration::from_millis(100))? == Woken::Stop {
            return Ok(());
        }
        while let Some(sample) = match service.delivery() {
            Delivery::Lossless => frames.receive()?,
            Delivery::Realtime => frames.latest()?,
        } {
            let header = *sample.header();
            if header.stamp.session != service.session() {
                continue;
            }
            if header.status == Status::END {
                service.health().dropped(intake.n_lost_before(&header));
                return view.end(&header.stamp, &waiter);
            }
            if !intake.takes(&header) {
                continue;
            }
            service.health().received(1);
            service.health().dropped(intake.n_lost_before(&header));
            let begin = now_nanos();
            view.answer(sample, &mut spare)?;
            intake.answered(&header, now_nanos() - begin);
            if service.stop().is_requested() {
                return Ok(());
            }
        }
    }
}

struct View<'a> {
    service: &'a Service,
    job: &'a Job,
    poses: Publisher<ViewPose>,
    evidence: SlicePublisher<f32, EvidenceHeader>,
}

impl View<'_> {
    fn answer(&self, sample: Sample<u8, FrameHeader>, spare: &mut Vec<f32>) -> Result<(), Failure> {
        let received_at_nanos = now_nanos();
        let stamp = sample.header().stamp;
        let outcome = self.solve(&sample, spare)?;
        // The frame goes back to the camera before anybody is waited for.
        drop(sample);
        let mut message = match &outcome {
            Ok((found, _)) => {
                let size = self.job.step.layout().image_size;
                wire::candidates_to_message(&found.candidates, size).or_fail(ExitKind::Run)?
            }
            Err(status) => ViewPose {
                status: *status,
                ..ViewPose::default()
            },
        };
        let timing = || Timing {
            received_at_nanos,
            sent_at_nanos: now_nanos(),
        };
        let stamp = Stamp {
            epoch: self.service.epoch(),
            ..stamp
        };
        // The evidence goes first: whoever has the candidates may count on it.
        if let Ok((found, Some(mut loan))) = outcome
            && !found.candidates.is_empty()
        {
            let layout = self.job.step.layout();
            let header = wire::levels_to_message(&found.levels, layout).or_fail(ExitKind::Run)?;
            *loan.header_mut() = EvidenceHeader {
                stamp,
                timing: timing(),
                ..header
            };
            loan.send()?;
        }
        message.stamp = stamp;
        message.timing = timing();
        self.poses.send(&message)?;
        let health = self.service.health();
        health.sent(stamp.frame);
        health.computed(Duration::from_nanos(now_nanos() - received_at_nanos));
        Ok(())
    }

    /// The estimate, and the responses it was made of if anybody wants them; or why there is none.
    #[expect(
        clippy::type_complexity,
        reason = "named nowhere else: an estimate with its loan, or a status"
    )]
    fn solve(
        &self,
        sample: &Sample<u8, FrameHeader>,
        spare: &mut Vec<f32>,
    ) -> Result<Result<(ViewEstimate, Option<Loan<'_, f32, EvidenceHeader>>), Status>, Failure>
    {
        let header = sample.header();
        if header.status != Status::OK {
            return Ok(Err(header.status));
        }
        let layout = self.job.step.layout();
        let size = [header.width as usize, header.height as usize];
        let image = match Rgb8View::new(size[0], size[1], sample.payload()) {
            Ok(image) if size == layout.image_size => image,
            _ => {
                tracing::warn!(?size, expected = ?layout.image_size, "a frame of another size");
                return Ok(Err(Status::BAD_INPUT));
            }
        };
        if self.job.n_evidence_consumers == 0 {
            spare.resize(layout.n_responses(), 0.0);
            return Ok(Ok((self.job.step.run(image, spare), None)));
        }
        let mut loan = self.evidence.loan(layout.n_responses())?;
        let found = self.job.step.run(image, loan.payload_mut());
        Ok(Ok((found, Some(loan))))
    }

    fn end(&self, stamp: &Stamp, waiter: &Waiter) -> Result<(), Failure> {
        let end = ViewPose {
            stamp: *stamp,
            status: Status::END,
            ..ViewPose::default()
        };
        let say = || -> Result<(), Failure> {
            self.poses.send(&end)?;
            Ok(())
        };
        say()?;
        self.service.health().finished();
        waiter.linger(|| self.poses.n_connected(), say)
    }
}
