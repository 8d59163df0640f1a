//! Sends the pictures of a live camera.

use core::time::Duration;

use failure::{Failure, now_nanos};
use messages::{CameraCounts, Status, TimedBy, UNMEASURED};
use runtime::Service;

use crate::camera::{Camera, Shot};
use crate::guard::Guard;
use crate::job::Job;
use crate::kept::Kept;
use crate::live::{Grid, LiveJob, Phase, Picture, Source};

/// Time after the nominal time of a frame for which the process waits for its picture. Two frame periods are added to it.
const PATIENCE_NANOS: u64 = 250_000_000;
/// Longest wait for a picture, so that a stop request is noticed.
const PAUSE: Duration = Duration::from_millis(20);
/// Number of pictures after which the rate of a camera is compared with the frame rate of the run.
const N_FOR_RATE: u64 = 100;
/// Largest accepted difference between the rate of a camera and the frame rate of the run, as a fraction of the latter.
const RATE_TOLERANCE: f64 = 0.02;

/// Sends the pictures of a live camera to their topic.
struct Live<'a, 'b> {
    camera: Camera<'a>,
    job: &'b Job,
    wanted: &'b LiveJob,
    source: Source,
    grid: Grid,
    phase: Phase,
    guard: Guard,
    counts: CameraCounts,
    /// Index of the next frame.
    at: u64,
    /// Reason why pictures were refused since the last used one.
    refused: Option<Status>,
    /// Reason why the last frame has no picture, if it has none. The next fields are the number of interruptions by cause, and whether the
    /// current interruption was logged.
    trouble: Option<Status>,
    said: Vec<(Status, u64)>,
    has_said: bool,
    has_warned: bool,
    has_warned_of_skew: bool,
}

/// Sends the pictures of a live camera until the run is stopped, or has all its frames.
///
/// # Errors
///
/// Fails with errors of the transport. If the camera cannot be opened, this is tried again and again.
pub(crate) fn run(service: &Service, job: &Job, live: &LiveJob) -> Result<(), Failure> {
    let mut camera = Camera::live(service, job, (&live.camera, live.size))?;
    let step = job.source.step as f64;
    let grid = Grid::new(service.session() + live.lead_nanos, live.rate_hz / step);
    let noted = camera.wait_for_receivers();
    let mut kept = Kept::open(service, job, live, &grid)?;
    // The frames that were due while the process was dead are lost.
    let at = noted.map_or(0, |sent| sent.max(grid.latest(now_nanos()) + 1));
    let mut it = Live {
        camera,
        job,
        wanted: live,
        source: Source::start(&live.camera, live.size, kept.as_ref().map(Kept::originals))?,
        phase: Phase::new(grid.period_nanos()),
        grid,
        guard: Guard::new(job.frozen_after, Some(live.rate_hz)),
        counts: CameraCounts::default(),
        at,
        refused: None,
        trouble: None,
        said: Vec::new(),
        has_said: false,
        has_warned: false,
        has_warned_of_skew: false,
    };
    let n_frames = job.source.count.unwrap_or(u64::MAX);
    while !it.camera.is_stopped()? && it.at < n_frames {
        if let Some(picture) = it.source.next(PAUSE) {
            it.take(&picture, n_frames)?;
            it.source.give_back(picture);
        }
        it.give_up_overdue(n_frames)?;
        it.count();
        if let Some(kept) = &mut kept {
            kept.send_all()?;
        }
    }
    if let Some(kept) = &mut kept {
        kept.end()?;
    }
    // All frames of the run are over, so waiting pictures are discarded.
    while let Some(picture) = it.source.next(Duration::ZERO) {
        it.counts.n_surplus += 1;
        it.source.give_back(picture);
    }
    it.count();
    if it.at >= n_frames {
        drop(it.source);
        return it.camera.end(n_frames);
    }
    Ok(())
}

impl Live<'_, '_> {
    fn index(&self, nth: u64) -> u64 {
        self.job.source.start + nth.saturating_mul(self.job.source.step)
    }

    /// Sends a picture as the frame to which it belongs. Earlier frames that have no picture are reported as left out.
    fn take(&mut self, picture: &Picture, n_frames: u64) -> Result<(), Failure> {
        if let Some(why) = self.grid.wrong_clock(picture.at_nanos, picture.arrived_at_nanos) {
            (self.refused, self.counts.n_refused) = (Some(why), self.counts.n_refused + 1);
            return Ok(());
        }
        let place = self.grid.place(picture.at_nanos, self.at);
        let Some(nth) = place.filter(|place| *place < n_frames) else {
            self.counts.n_surplus += 1;
            return Ok(());
        };
        // Pictures that were replaced by newer ones count as dropped, like frames of footage that are sent too late.
        let n_dropped = picture.n_overtaken.min(nth.saturating_sub(self.at));
        if n_dropped > 0 {
            self.camera.drop_frames(n_dropped);
            self.at += n_dropped;
        }
        while self.at < nth {
            let status = self.refused.unwrap_or(Status::LEFT_OUT);
            self.send_nothing(self.source.trouble().unwrap_or(status))?;
        }
        let index = self.index(nth);
        let time_s = self.grid.seconds(picture.at_nanos);
        self.counts.off_grid_nanos = self.grid.off_nanos(picture.at_nanos, nth);
        self.phase.by_clock(picture.timed_by == TimedBy::CAMERA);
        if self.phase.add(picture.at_nanos, self.counts.off_grid_nanos) {
            self.warn_of_skew();
        }
        if let Some(status) = self.guard.check(index, Some(time_s), &picture.rgb) {
            self.counts.n_refused += 1;
            return self.send_nothing(status);
        }
        self.say_that_it_is_back(index);
        let shot = Shot {
            // Some drivers give the time at which the picture will be complete.
            captured_at: picture.at_nanos.min(picture.arrived_at_nanos),
            asked_at: picture.arrived_at_nanos,
            skew: self.counts.off_grid_nanos,
        };
        self.camera.send_frame(index, &picture.rgb, shot)?;
        self.counts.n_used += 1;
        self.refused = None;
        self.advance();
        Ok(())
    }

    /// Sends the reason why the next frame has no picture.
    fn send_nothing(&mut self, status: Status) -> Result<(), Failure> {
        let index = self.index(self.at);
        self.say_why(index, status);
        self.camera.send_nothing(index, status)?;
        self.advance();
        Ok(())
    }

    /// Logs a reason for missing pictures the first time, and then each time the number of missing pictures has doubled.
    fn say_why(&mut self, index: u64, status: Status) {
        let is_new = self.trouble.replace(status) != Some(status);
        if !is_new {
            return;
        }
        let known = self.said.iter_mut().find(|known| known.0 == status);
        let n = if let Some((_, n)) = known {
            *n += 1;
            *n
        } else {
            self.said.push((status, 1));
            1
        };
        if n.is_power_of_two() {
            self.has_said = true;
            let (view, cause) = (self.job.view, status.reason());
            tracing::warn!(
                view,
                frame = index,
                cause,
                times = n,
                "the camera gives no picture"
            );
        }
    }

    /// Logs that the camera delivers pictures again, if their absence was logged.
    fn say_that_it_is_back(&mut self, index: u64) {
        if self.trouble.take().is_some() && core::mem::take(&mut self.has_said) {
            tracing::info!(
                view = self.job.view,
                frame = index,
                "the camera gives pictures again"
            );
        }
    }

    fn advance(&mut self) {
        self.at += 1;
        self.camera.note(self.at);
    }

    /// Gives up frames whose picture is overdue. If the camera is known to be disconnected, does not wait for pictures.
    fn give_up_overdue(&mut self, n_frames: u64) -> Result<(), Failure> {
        let trouble = self.source.trouble();
        let patience = match trouble {
            Some(_) => self.grid.period_nanos(),
            None => PATIENCE_NANOS + 2 * self.grid.period_nanos(),
        };
        let status = trouble.or(self.refused).unwrap_or(Status::NO_FRAME);
        while self.at < n_frames && self.grid.due_nanos(self.at) + patience < now_nanos() {
            self.send_nothing(status)?;
        }
        Ok(())
    }

    /// Logs once if pictures are taken too long before or after the nominal times of their frames.
    fn warn_of_skew(&mut self) {
        let Some(skew) = self.phase.skew_nanos() else {
            return;
        };
        if self.has_warned_of_skew || skew.unsigned_abs() <= self.wanted.max_skew_nanos {
            return;
        }
        self.has_warned_of_skew = true;
        tracing::warn!(
            camera = self.wanted.name,
            skew_ms = skew as f64 * 1e-6,
            max_skew_ms = self.wanted.max_skew_nanos as f64 * 1e-6,
            drift_ppm = self.phase.drift_ppb().map(|drift_ppb| drift_ppb as f64 * 1e-3),
            "this camera takes its pictures far from the instants of the frames"
        );
    }

    /// Updates the counts for programs that observe the run.
    fn count(&mut self) {
        let tally = self.source.tally();
        let counts = CameraCounts {
            n_connections: tally.n_connections,
            n_made: tally.n_lost + tally.n_delivered,
            n_lost: tally.n_lost,
            n_delivered: tally.n_delivered,
            n_overtaken: tally.n_overtaken,
            n_refused: self.counts.n_refused + tally.n_damaged,
            skew_nanos: self.phase.skew_nanos().unwrap_or(UNMEASURED),
            drift_ppb: self.phase.drift_ppb().unwrap_or(UNMEASURED),
            delay_nanos: tally.delay_nanos.unwrap_or(UNMEASURED),
            timed_by: tally.timed_by,
            rate_microhertz: tally.rate_hz.map_or(0, |rate_hz| (rate_hz * 1e6).round() as u64),
            ..self.counts
        };
        self.camera.report(counts);
        let rate_hz = tally.rate_hz.unwrap_or(self.wanted.rate_hz);
        let is_off = (rate_hz / self.wanted.rate_hz - 1.0).abs() > RATE_TOLERANCE;
        if is_off && !self.has_warned && tally.n_delivered > N_FOR_RATE {
            self.has_warned = true;
            tracing::warn!(
                view = self.job.view,
                rate_hz,
                wanted_hz = self.wanted.rate_hz,
                "the frame rate of this camera differs from the frame rate of the run"
            );
        }
    }
}
