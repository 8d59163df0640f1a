//! The loop: wait until a frame is due, decode, warp into shared memory, send.

use core::time::Duration;

use footage::{Fill, Pacer, Size, SourceSpec, Warp};
use geometry::Framing;
use messages::{Cause, FrameHeader, Stamp, Status, Timing, topic};
use metrics::Passage;
use runtime::{
    ExitKind, Failure, OrFail as _, Place, Service, SlicePublisher, Waiter, Woken, now_nanos,
};

use crate::supply::{Step, Supply};
use crate::{Faults, Mode, Pace};

/// What one camera's process has to do.
#[derive(Debug)]
pub struct Job {
    /// The view.
    pub view: usize,
    /// The footage.
    pub source: SourceSpec,
    /// What goes wrong with it on purpose.
    pub faults: Faults,
    /// Repetitions from which on a picture is called frozen; 0 for never.
    pub frozen_after: u32,
    /// From the footage to the frames of the pipeline.
    pub framing: Framing,
    /// Whether frames may be dropped.
    pub mode: Mode,
    /// How fast frames are handed out.
    pub pace: Pace,
    /// Processes that take the frames.
    pub n_consumers: usize,
    /// How long they are waited for.
    pub patience: Duration,
}

/// Footage may begin only when every process is there; with a clock running, this much later.
const LEAD_NANOS: u64 = 2_000_000_000;

/// Sends the footage of one view, then its end.
///
/// A frame that has no picture, or one that something is wrong with, is sent without pixels and says why
/// ([`Status::CAMERA_FAULTS`]).
///
/// # Errors
///
/// [`ExitKind::Input`] if the footage cannot be opened, and what the transport says.
pub fn run(service: &Service, job: &Job) -> Result<(), Failure> {
    let is_live = job.pace == Pace::Realtime;
    let faults = job.faults.of_life(service.epoch());
    let supply = Supply::open(&job.source, &faults, is_live, job.frozen_after);
    let mut supply = supply.or_fail(ExitKind::Input)?;
    service.health().set_total(supply.info().n_frames);
    let mut camera = Camera::open(service, job, &supply)?;
    let mut at = camera.go_on(&mut supply);
    while !service.stop().is_requested() {
        at += camera.wait_until_due(&mut supply, at)?;
        if service.stop().is_requested() {
            break;
        }
        let (asked_at, index) = (now_nanos(), supply.index());
        let step = supply.step(asked_at);
        camera.tell(index, step);
        match step {
            Step::Picture => camera.send_frame(index, supply.pixels(), asked_at)?,
            Step::Nothing(status) => {
                camera.send_empty(index, status)?;
                service.health().sent(index);
            }
            Step::End => return camera.end(at),
        }
        at += 1;
        camera.note(at);
    }
    Ok(())
}

struct Camera<'a> {
    service: &'a Service,
    job: &'a Job,
    publisher: SlicePublisher<u8, FrameHeader>,
    warp: Warp,
    pacer: Pacer,
    waiter: Waiter,
    place: Place,
    n_dropped: u64,
    /// Fewer than the job's consumers once some have been waited for in vain.
    n_expected: usize,
    /// Why there is no picture at the moment, if there is none.
    trouble: Option<Status>,
}

impl<'a> Camera<'a> {
    fn open(service: &'a Service, job: &'a Job, supply: &Supply) -> Result<Self, Failure> {
        let publisher = service.bus().slice_publisher(&topic::frame(job.view))?;
        let [width, height] = job.framing.out_size().map(|it| it as usize);
        // What lies beside a picture that was turned is nothing; beside one that was not, its border
        // goes on, as it did for the program that results are compared with.
        let fill = if job.framing.roll() == 0.0 {
            Fill::Replicate
        } else {
            Fill::Black
        };
        let map = job.framing.source_from_output();
        let output = Size::new(width, height);
        let warp = Warp::new(supply.info().size, output, &map, fill).or_fail(ExitKind::Input)?;
        let pacer = match (job.pace, supply.info().frame_rate_hz) {
            (Pace::Realtime, Some(rate)) => Pacer::realtime(service.session() + LEAD_NANOS, rate),
            _ => Pacer::as_fast_as_possible(),
        };
        Ok(Self {
            service,
            job,
            publisher,
            warp,
            pacer,
            waiter: service.bus().waiter(),
            place: Place::of(service.bus()),
            n_dropped: 0,
            n_expected: job.n_consumers,
            trouble: None,
        })
    }

    /// Waits for the consumers, then passes over what an earlier life of this process has sent.
    fn go_on(&mut self, supply: &mut Supply) -> u64 {
        let patience = self.service.patience_at_start(self.job.patience);
        let n = self
            .publisher
            .wait_for_subscribers(self.n_expected, patience);
        if n < self.n_expected {
            tracing::warn!(
                n,
                expected = self.n_expected,
                "beginning without all receivers"
            );
            self.n_expected = n;
        }
        if self.service.epoch() == 0 {
            return 0;
        }
        let [sent] = self.place.noted().unwrap_or([0]);
        supply.skip(sent)
    }

    /// Says once that the camera's pictures have gone, and once that they are back.
    fn tell(&mut self, frame: u64, step: Step) {
        let trouble = match step {
            Step::Nothing(status) => Some(status),
            Step::Picture | Step::End => None,
        };
        if trouble == self.trouble {
            return;
        }
        let view = self.job.view;
        if let Some(it) = trouble {
            tracing::warn!(view, frame, cause = it.reason(), "without a picture");
        } else {
            tracing::info!(view, frame, "pictures again");
        }
        self.trouble = trouble;
    }

    /// Waits until frame `at` is due; with a clock that drops frames, passes over those that are past.
    ///
    /// Returns how many were passed over.
    fn wait_until_due(&mut self, supply: &mut Supply, at: u64) -> Result<u64, Failure> {
        while self.pacer.wait_nanos(at, now_nanos()) > 0 {
            let nanos = self.pacer.wait_nanos(at, now_nanos());
            if self.waiter.wait(Duration::from_nanos(nanos))? == Woken::Stop {
                return Ok(0);
            }
        }
        let latest = self.pacer.latest_due(now_nanos()).unwrap_or(at);
        if self.job.mode == Mode::Lossless || latest <= at {
            return Ok(0);
        }
        let n = supply.skip(latest - at);
        self.n_dropped += n;
        self.service.health().dropped(Cause::BehindClock, n);
        Ok(n)
    }

    /// Sends a frame; where nothing may be lost, once more to a receiver that had to be restarted.
    fn send_frame(&mut self, index: u64, rgb: &[u8], asked_at: u64) -> Result<(), Failure> {
        let mut computing = now_nanos() - asked_at;
        loop {
            let [width, height] = self.job.framing.out_size();
            let mut loan = self.publisher.loan((width * height * 3) as usize)?;
            let begin = now_nanos();
            self.warp.apply(rgb, loan.payload_mut());
            computing += now_nanos() - begin;
            *loan.header_mut() = FrameHeader {
                width,
                height,
                ..self.header(index, Status::OK, asked_at)
            };
            let n = loan.send()?;
            if self.job.mode == Mode::Realtime || n >= self.n_expected {
                break;
            }
            let n = self
                .publisher
                .wait_for_subscribers(self.n_expected, self.job.patience);
            if self.service.stop().is_requested() {
                break;
            }
            if n < self.n_expected {
                tracing::warn!(
                    n,
                    expected = self.n_expected,
                    "going on without all receivers"
                );
                self.n_expected = n;
                break;
            }
        }
        self.n_expected = self
            .n_expected
            .max(self.publisher.n_connected().min(self.job.n_consumers));
        let health = self.service.health();
        health.sent(index);
        health.passed(&Passage {
            waiting: None,
            computing,
            publishing: (now_nanos() - asked_at).saturating_sub(computing),
            since_capture: None,
        });
        Ok(())
    }

    /// Sends that there is no picture of a frame, and why; or that there are no more frames.
    fn send_empty(&self, frame: u64, status: Status) -> Result<(), Failure> {
        let mut loan = self.publisher.loan(1)?;
        loan.payload_mut().fill(0);
        *loan.header_mut() = self.header(frame, status, now_nanos());
        loan.send()?;
        Ok(())
    }

    fn header(&self, frame: u64, status: Status, asked_at: u64) -> FrameHeader {
        FrameHeader {
            stamp: Stamp {
                session: self.service.session(),
                frame,
                captured_at_nanos: asked_at,
                view: self.job.view as u32,
                epoch: self.service.epoch(),
            },
            timing: Timing {
                received_at_nanos: asked_at,
                sent_at_nanos: now_nanos(),
            },
            status,
            n_dropped: self.n_dropped,
            ..FrameHeader::default()
        }
    }

    /// Notes where a restarted process goes on.
    fn note(&mut self, n_sent: u64) {
        if let Err(error) = self.place.note([n_sent]) {
            tracing::debug!(%error, "cannot note the place in the footage");
        }
    }

    /// Says that the footage is over, and how many frames it had.
    fn end(&self, n_frames: u64) -> Result<(), Failure> {
        let beyond = self.job.source.start + n_frames * self.job.source.step;
        let say = || self.send_empty(beyond, Status::END);
        say()?;
        self.service.health().finished();
        self.waiter.linger(|| self.publisher.n_connected(), say)
    }
}
