//! The loop: take a frame, write the responses into shared memory, send candidates and evidence.

use core::time::Duration;

use fmp::{Moment, Scope, Tracker};
use kernels::Rgb8View;
use messages::{
    Cause, EvidenceHeader, FrameHeader, Searched, Stamp, Status, Timing, ViewPose, topic,
};
use metrics::Passage;
use pipeline::{ViewEstimate, ViewStep};
use runtime::{
    Delivery, ExitKind, Failure, Loan, OrFail as _, Place, Publisher, Sample, Service,
    SlicePublisher, Waiter, Woken, now_nanos,
};

use crate::intake::{Intake, Past};

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
    /// Frames of the footage a second, where it is known: how far a pose may have moved.
    pub frame_rate_hz: Option<f64>,
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
    view.wait_for_receivers();
    let mut place = Place::of(bus);
    let past = place.noted().filter(|_| service.epoch() > 0);
    let past = past.map(Past::from_numbers).unwrap_or_default();
    let frame_range = [job.start_frame, job.frame_step];
    let mut intake = Intake::new(service.delivery(), frame_range, past);
    let mut memory = Memory {
        tracker: job.step.tracker(),
        responses: Vec::new(),
    };
    loop {
        if waiter.wait(Duration::from_millis(100))? == Woken::Stop {
            return Ok(());
        }
        while let Some(sample) = match service.delivery() {
            Delivery::Lossless => frames.receive()?,
            Delivery::Realtime => frames.latest()?,
        } {
            let header = *sample.header();
            if !view.is_ours(&sample) {
                continue;
            }
            if header.status == Status::END {
                let n = intake.n_lost_before(&header);
                service.health().dropped(Cause::Busy, n);
                return view.end(&header.stamp, &waiter);
            }
            if !intake.takes(&header) {
                continue;
            }
            service.health().received(1);
            let n = intake.n_lost_before(&header);
            service.health().dropped(Cause::Busy, n);
            let begin = now_nanos();
            let nth = intake.nth(header.stamp.frame);
            view.answer(sample, nth, &mut memory)?;
            intake.answered(&header, now_nanos() - begin);
            if let Err(error) = place.note(intake.past().numbers()) {
                tracing::debug!(%error, "cannot note how far this view has come");
            }
            if service.stop().is_requested() {
                return Ok(());
            }
        }
    }
}

/// What is kept from frame to frame.
struct Memory {
    tracker: Tracker,
    /// Responses that do not lie in shared memory.
    responses: Vec<f32>,
}

/// What was found in a frame, and its evidence if anybody wants it.
struct Found<'a> {
    estimate: ViewEstimate,
    /// How long memory for the evidence was waited for.
    loan_nanos: u64,
    /// The responses of the scope that was searched.
    evidence: Option<Loan<'a, f32, EvidenceHeader>>,
}

struct View<'a> {
    service: &'a Service,
    job: &'a Job,
    poses: Publisher<ViewPose>,
    evidence: SlicePublisher<f32, EvidenceHeader>,
}

impl View<'_> {
    fn wait_for_receivers(&self) {
        let job = self.job;
        let patience = self.service.patience_at_start(job.patience);
        let n = self
            .poses
            .wait_for_subscribers(job.n_pose_consumers, patience);
        tracing::info!(n, expected = job.n_pose_consumers, "candidates are awaited");
        let n = self
            .evidence
            .wait_for_subscribers(job.n_evidence_consumers, patience);
        tracing::info!(
            n,
            expected = job.n_evidence_consumers,
            "evidence is awaited, begins"
        );
    }

    /// Whether a frame is one of this view and run; counts it if it is not.
    fn is_ours(&self, frame: &Sample<u8, FrameHeader>) -> bool {
        let expected = wire::Expected {
            session: self.service.session(),
            view: self.job.view,
            now_nanos: now_nanos(),
        };
        let checked = wire::check_frame(frame.header(), frame.payload().len(), &expected);
        if let Err(error) = &checked {
            let health = self.service.health();
            health.refuse(error.refusal(), "frame", error);
        }
        checked.is_ok()
    }

    /// * `nth`: which of the frames that are used this is.
    fn answer(
        &self,
        sample: Sample<u8, FrameHeader>,
        nth: u64,
        memory: &mut Memory,
    ) -> Result<(), Failure> {
        let received_at_nanos = now_nanos();
        let FrameHeader {
            stamp,
            timing: before,
            ..
        } = *sample.header();
        let outcome = self.solve(&sample, nth, memory)?;
        // The frame goes back to the camera before anybody is waited for.
        drop(sample);
        let mut message = match &outcome {
            Ok(found) => self.message(found)?,
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
        let health = self.service.health();
        let solved = now_nanos();
        let loan_nanos = outcome.as_ref().map_or(0, |it| it.loan_nanos);
        // The evidence goes first: whoever has the candidates may count on it.
        if let Ok(found) = outcome
            && let Some(mut loan) = found.evidence
        {
            let layout = self.job.step.layout();
            let it = &found.estimate;
            let header = wire::evidence_to_message(&it.levels, &it.bounds, &it.scope, layout);
            let header = header.or_fail(ExitKind::Run)?;
            *loan.header_mut() = EvidenceHeader {
                stamp,
                timing: timing(),
                ..header
            };
            loan.send()?;
            health.sent_evidence(message.evidence_bytes);
        }
        message.stamp = stamp;
        message.timing = timing();
        self.poses.send(&message)?;
        health.sent(stamp.frame);
        health.passed(&Passage {
            waiting: Some(received_at_nanos.saturating_sub(before.sent_at_nanos)),
            computing: (solved - received_at_nanos).saturating_sub(loan_nanos),
            publishing: now_nanos() - solved + loan_nanos,
            since_capture: Some(
                message
                    .timing
                    .sent_at_nanos
                    .saturating_sub(stamp.captured_at_nanos),
            ),
        });
        Ok(())
    }

    /// The candidates, how they were looked for, and how much goes with them.
    fn message(&self, found: &Found<'_>) -> Result<ViewPose, Failure> {
        let layout = self.job.step.layout();
        let Found {
            estimate, evidence, ..
        } = found;
        let message = wire::candidates_to_message(&estimate.candidates, layout.image_size);
        let mut message = message.or_fail(ExitKind::Run)?;
        wire::local_to_message(&mut message, &estimate.local).or_fail(ExitKind::Run)?;
        let n_values = evidence
            .as_ref()
            .map_or(0, |_| layout.n_values(&estimate.scope));
        Ok(ViewPose {
            searched: if estimate.scope == Scope::whole(layout) {
                Searched::FULL
            } else {
                Searched::TRACKED
            },
            evidence_bytes: (n_values * size_of::<f32>()) as u64,
            ..message
        })
    }

    /// The estimate, and the responses it was made of if anybody wants them; or why there is none.
    fn solve(
        &self,
        sample: &Sample<u8, FrameHeader>,
        nth: u64,
        memory: &mut Memory,
    ) -> Result<Result<Found<'_>, Status>, Failure> {
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
        let rate = self.job.frame_rate_hz;
        let at = Moment {
            frame: nth,
            seconds: rate.map(|it| header.stamp.frame as f64 / it),
        };
        let scope = memory.tracker.scope(layout, at);
        let mut found = self.find(image, scope, &mut memory.responses)?;
        if self.job.step.gives_up(&memory.tracker, &found.estimate) {
            // Its room for evidence goes back first.
            drop(found);
            found = self.find(image, Scope::whole(layout), &mut memory.responses)?;
        }
        let step = &self.job.step;
        step.follow(&mut memory.tracker, at, &found.estimate);
        Ok(Ok(found))
    }

    /// Searches a frame. Responses that anybody wants are written in shared memory from the first.
    fn find(
        &self,
        image: Rgb8View<'_>,
        scope: Scope,
        responses: &mut Vec<f32>,
    ) -> Result<Found<'_>, Failure> {
        let (step, layout) = (&self.job.step, self.job.step.layout());
        let n_values = layout.n_values(&scope);
        if self.job.n_evidence_consumers == 0 {
            responses.resize(responses.len().max(n_values), 0.0);
            return Ok(Found {
                estimate: step.run(image, scope, responses),
                loan_nanos: 0,
                evidence: None,
            });
        }
        let begin = now_nanos();
        let mut loan = self.evidence.loan(n_values)?;
        let loan_nanos = now_nanos() - begin;
        let estimate = step.run(image, scope, loan.payload_mut());
        let is_there = !estimate.candidates.is_empty();
        Ok(Found {
            evidence: is_there.then_some(loan),
            estimate,
            loan_nanos,
        })
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
