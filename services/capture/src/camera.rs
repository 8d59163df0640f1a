//! Waits until a frame is due, warps it into shared memory, and sends it.

use core::time::Duration;
use std::rc::Rc;

use failure::{ExitKind, Failure, OrFail as _, now_nanos};
use footage::{Fill, Pacer, Size, Warp, shrunk_map};
use messages::{CameraCounts, Cause, FrameHeader, Stamp, Status, Timing, topic};
use runtime::metrics::Passage;
use runtime::{Place, Service, SlicePublisher, Woken};
use stage::Stage;

use crate::info::FeedInfo;
use crate::job::Job;
use crate::live::LiveCamera;
use crate::supply::{Step, Supply};
use deployment::capture::{Mode, Pace};

/// Time at which a picture was taken, and time at which it was requested (footage) or arrived (live camera), in nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shot {
    pub(crate) captured_at: u64,
    pub(crate) asked_at: u64,
    /// Time from the nominal time of the frame until the picture was taken.
    pub(crate) skew: i64,
}

/// Warps the pictures of a camera. If they are all the same, only the first one is warped.
struct Warper {
    warp: Warp,
    is_still: bool,
    /// The warped picture, if all are the same.
    kept: Option<Vec<u8>>,
}

impl Warper {
    fn apply(&mut self, rgb: &[u8], out: &mut [u8]) {
        if let Some(kept) = &self.kept {
            out.copy_from_slice(kept);
            return;
        }
        self.warp.apply(rgb, out);
        self.kept = self.is_still.then(|| out.to_vec());
    }
}

/// One camera, with the topic of its frames.
pub(crate) struct Camera<'a> {
    service: &'a Service,
    job: &'a Job,
    stage: Stage<'a, ()>,
    publisher: Rc<SlicePublisher<u8, FrameHeader>>,
    warper: Warper,
    pacer: Pacer,
    place: Place,
    n_dropped: u64,
    /// Number of receivers that the camera waits for. It is lower than the number in the settings if some receivers did not connect in
    /// time.
    n_expected: usize,
    /// Reason why the last frame had no picture, if it had none.
    trouble: Option<Status>,
}

impl<'a> Camera<'a> {
    /// Opens the footage of a camera.
    pub(crate) fn open(
        service: &'a Service,
        job: &'a Job,
        supply: &Supply,
    ) -> Result<Self, Failure> {
        let pacer = match (job.pace, supply.info().frame_rate_hz) {
            (Pace::Realtime, Some(rate)) => {
                Pacer::realtime(service.session() + job.lead_nanos, rate)
            }
            _ => Pacer::as_fast_as_possible(),
        };
        let FeedInfo { size, shrink, .. } = supply.info();
        let mut camera = Self::new(service, job, (size, shrink), pacer)?;
        camera.warper.is_still = supply.is_still();
        Ok(camera)
    }

    /// Opens a live camera, which sets its own pace.
    ///
    /// * `camera`, `size`: the camera and the size of its pictures, before they are shrunk.
    pub(crate) fn live(
        service: &'a Service,
        job: &'a Job,
        (camera, size): (&LiveCamera, Size),
    ) -> Result<Self, Failure> {
        let shrink = camera.shrink(size);
        let pictures = (size.shrunk(shrink), shrink);
        Self::new(service, job, pictures, Pacer::as_fast_as_possible())
    }

    /// Creates a camera.
    ///
    /// * `size`: size of the pictures, and factor by which they were shrunk.
    fn new(
        service: &'a Service,
        job: &'a Job,
        (size, shrink): (Size, usize),
        pacer: Pacer,
    ) -> Result<Self, Failure> {
        let mut stage = Stage::new(service, job.patience);
        let publisher = stage.bulk_output(&topic::frame(job.view), job.n_consumers)?;
        let [width, height] = job.framing.out_size().map(|side| side as usize);
        // The area outside a rotated picture is filled with black. Without rotation, the border pixels are repeated, as in the authors'
        // program.
        let fill = if job.framing.roll() == 0.0 {
            Fill::Replicate
        } else {
            Fill::Black
        };
        let map = shrunk_map(&job.framing.source_from_output(), shrink as f64);
        let output = Size::new(width, height);
        let warp = Warp::new(size, output, &map, fill).or_fail(ExitKind::Input)?;
        Ok(Self {
            service,
            job,
            stage,
            publisher,
            warper: Warper {
                warp,
                is_still: false,
                kept: None,
            },
            pacer,
            place: Place::of(service.bus()),
            n_dropped: 0,
            n_expected: job.n_consumers,
            trouble: None,
        })
    }

    /// Waits for the receivers, then skips the frames that earlier epochs of this process have sent. Returns their number.
    pub(crate) fn resume(&mut self, supply: &mut Supply) -> u64 {
        self.wait_for_receivers().map_or(0, |sent| supply.skip(sent))
    }

    /// Waits for the receivers. Returns the number of frames that earlier epochs of this process have sent, if there were any.
    pub(crate) fn wait_for_receivers(&mut self) -> Option<u64> {
        let patience = self.service.patience_at_start(self.job.patience);
        let n = self.publisher.wait_for_subscribers(self.n_expected, patience);
        if n < self.n_expected {
            tracing::warn!(
                n,
                expected = self.n_expected,
                "starting before all receivers are connected"
            );
            self.n_expected = n;
        }
        if self.service.epoch() == 0 {
            return None;
        }
        let [sent] = self.place.noted().unwrap_or([0]);
        Some(sent)
    }

    /// Starts an iteration of the main loop. Returns true if the run is to end.
    pub(crate) fn is_stopped(&self) -> Result<bool, Failure> {
        Ok(self.stage.wait(Duration::ZERO)? == Woken::Stop)
    }

    /// Counts frames that were not sent because this process was too late for them.
    pub(crate) fn drop_frames(&mut self, n: u64) {
        self.n_dropped += n;
        self.service.health().dropped(Cause::BehindClock, n);
    }

    /// Updates the counts of a live camera's pictures.
    pub(crate) fn report(&self, counts: CameraCounts) {
        self.service.health().camera(counts);
    }

    /// Logs once when the camera stops delivering pictures, and once when it delivers them again.
    pub(crate) fn log_trouble(&mut self, frame: u64, step: Step) {
        let trouble = match step {
            Step::Nothing(status) => Some(status),
            Step::Picture | Step::End => None,
        };
        if trouble == self.trouble {
            return;
        }
        // A source that is opened again may have another picture.
        self.warper.kept = None;
        let view = self.job.view;
        if let Some(status) = trouble {
            tracing::warn!(
                view,
                frame,
                cause = status.reason(),
                "the camera gives no picture"
            );
        } else {
            tracing::info!(view, frame, "the camera gives pictures again");
        }
        self.trouble = trouble;
    }

    /// Waits until frame `at` is due. If frames may be dropped, skips overdue frames.
    ///
    /// Returns the number of skipped frames.
    pub(crate) fn wait_until_due(&mut self, supply: &mut Supply, at: u64) -> Result<u64, Failure> {
        while self.pacer.wait_nanos(at, now_nanos()) > 0 {
            let nanos = self.pacer.wait_nanos(at, now_nanos());
            if self.stage.wait(Duration::from_nanos(nanos))? == Woken::Stop {
                return Ok(0);
            }
        }
        let latest = self.pacer.latest_due(now_nanos()).unwrap_or(at);
        if self.job.mode.is_lossless() || latest <= at {
            return Ok(0);
        }
        let n = supply.skip(latest - at);
        self.drop_frames(n);
        Ok(n)
    }

    /// Sends a frame. With lossless delivery, sends it again if a receiver was restarted.
    pub(crate) fn send_frame(&mut self, index: u64, rgb: &[u8], shot: Shot) -> Result<(), Failure> {
        let asked_at = shot.asked_at;
        let is_live = self.job.live.is_some();
        let mut computing = now_nanos() - asked_at;
        loop {
            let [width, height] = self.job.framing.out_size();
            let mut loan = self.publisher.loan((width * height * 3) as usize)?;
            let begin = now_nanos();
            self.warper.apply(rgb, loan.payload_mut());
            computing += now_nanos() - begin;
            *loan.header_mut() = FrameHeader {
                width,
                height,
                ..self.header(index, Status::OK, shot)
            };
            let n = loan.send()?;
            if self.job.mode == Mode::Realtime || n >= self.n_expected {
                break;
            }
            let n = self.publisher.wait_for_subscribers(self.n_expected, self.job.patience);
            if self.service.stop().is_requested() {
                break;
            }
            if n < self.n_expected {
                tracing::warn!(
                    n,
                    expected = self.n_expected,
                    "continuing without some receivers"
                );
                self.n_expected = n;
                break;
            }
        }
        self.n_expected =
            self.n_expected.max(self.publisher.n_connected().min(self.job.n_consumers));
        let health = self.service.health();
        health.sent(index);
        health.passed(&Passage {
            waiting: is_live.then(|| asked_at.saturating_sub(shot.captured_at)),
            computing,
            publishing: (now_nanos() - asked_at).saturating_sub(computing),
            since_capture: is_live.then(|| now_nanos().saturating_sub(shot.captured_at)),
        });
        Ok(())
    }

    /// Sends a frame without a picture and the reason, or the end of the stream.
    pub(crate) fn send_empty(&self, frame: u64, status: Status) -> Result<(), Failure> {
        let mut loan = self.publisher.loan(1)?;
        loan.payload_mut().fill(0);
        let now = now_nanos();
        let shot = Shot {
            captured_at: now,
            asked_at: now,
            skew: 0,
        };
        *loan.header_mut() = self.header(frame, status, shot);
        loan.send()?;
        Ok(())
    }

    /// Sends a frame without a picture, and counts it as sent.
    pub(crate) fn send_nothing(&self, frame: u64, status: Status) -> Result<(), Failure> {
        self.send_empty(frame, status)?;
        self.service.health().sent(frame);
        Ok(())
    }

    fn header(&self, frame: u64, status: Status, shot: Shot) -> FrameHeader {
        FrameHeader {
            stamp: Stamp {
                session: self.service.session(),
                frame,
                captured_at_nanos: shot.captured_at,
                view: self.job.view as u32,
                epoch: self.service.epoch(),
            },
            timing: Timing {
                received_at_nanos: shot.asked_at,
                sent_at_nanos: now_nanos(),
            },
            status,
            n_dropped: self.n_dropped,
            skew_nanos: shot.skew,
            ..FrameHeader::default()
        }
    }

    /// Saves the position at which a restarted process continues.
    pub(crate) fn note(&mut self, n_sent: u64) {
        if let Err(error) = self.place.note([n_sent]) {
            tracing::debug!(%error, "cannot save the position in the footage");
        }
    }

    /// Sends the end of the stream, which contains the number of frames.
    pub(crate) fn end(&self, n_frames: u64) -> Result<(), Failure> {
        let beyond = self.job.source.start + n_frames * self.job.source.step;
        let n_connected = || self.publisher.n_connected();
        let send_end = || self.send_empty(beyond, Status::END);
        self.stage.end_with(n_connected, send_end)
    }
}
