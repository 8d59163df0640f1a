//! The pictures of a camera that may fail. The camera is reopened after a failure, and every frame is checked.

#[cfg(test)]
mod tests;

use footage::{FootageError, Size, SourceSpec};
use messages::Status;

use crate::feed::FeedError;
use crate::guard::Guard;
use crate::info::FeedInfo;
use crate::retimed::Retimed;
use deployment::Timeline;
use deployment::capture::{Fault, FaultKind, Faults};

/// Time between attempts to reopen a camera, in nanoseconds.
const PAUSE_NANOS: u64 = 500_000_000;
/// Number of consecutive failures after which footage without a clock is abandoned, because it cannot recover.
const MAX_FAILURES: u32 = 3;

/// Outcome of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Step {
    /// The frame has a picture: [`Supply::pixels`].
    Picture,
    /// The frame has no picture, for this reason.
    Nothing(Status),
    /// There are no more frames.
    End,
}

/// The frames of a camera in order. Every frame has an outcome.
#[derive(Debug)]
pub(crate) struct Supply {
    spec: SourceSpec,
    /// Timeline of a camera with a clock of its own. `spec` then counts common frame times.
    timeline: Option<Timeline>,
    faults: Faults,
    info: FeedInfo,
    /// True if frames follow a clock, so that a lost camera may be reopened.
    is_live: bool,
    feed: Option<Retimed>,
    /// Position of the next frame among the used frames.
    at: u64,
    /// Index and time of a frame that was read too early.
    early: Option<(u64, Option<f64>)>,
    /// The picture that is repeated while the camera is frozen.
    held: Option<Vec<u8>>,
    guard: Guard,
    is_still: bool,
    /// Reason why there is no picture, after a failure.
    cause: Status,
    n_failures: u32,
    retry_at: u64,
    is_abandoned: bool,
}

impl Supply {
    /// Opens the footage, or creates the scene.
    ///
    /// * `is_live`: true if frames follow a clock, and a lost camera may be reopened.
    /// * `frozen_after`: see [`deployment::capture::Config::frozen_after`].
    ///
    /// # Errors
    ///
    /// Fails with [`FeedError`] if the camera cannot be opened at the start, which is an error of the deployment.
    pub(crate) fn open(
        (spec, timeline): (&SourceSpec, Option<&Timeline>),
        faults: &Faults,
        is_live: bool,
        frozen_after: u32,
    ) -> Result<Self, FeedError> {
        let feed = Retimed::open(spec, timeline)?;
        let info = feed.info();
        let rate_hz = info.frame_rate_hz.map(|rate_hz| rate_hz * spec.step as f64);
        let is_still = feed.is_still();
        let frozen_after = if is_still { 0 } else { frozen_after };
        Ok(Self {
            spec: spec.clone(),
            timeline: timeline.copied(),
            faults: faults.clone(),
            info,
            is_live,
            feed: Some(feed),
            at: 0,
            early: None,
            held: None,
            guard: Guard::new(frozen_after, rate_hz),
            is_still,
            cause: Status::NO_FRAME,
            n_failures: 0,
            retry_at: 0,
            is_abandoned: false,
        })
    }

    /// Returns the properties of the pictures.
    pub(crate) fn info(&self) -> FeedInfo {
        self.info
    }

    /// Returns true if all pictures are the same by design.
    pub(crate) fn is_still(&self) -> bool {
        self.is_still
    }

    /// Returns the index in the footage of the next frame.
    pub(crate) fn index(&self) -> u64 {
        self.index_of(self.at)
    }

    fn index_of(&self, nth: u64) -> u64 {
        let offset = nth.saturating_mul(self.spec.step);
        self.spec.start.saturating_add(offset)
    }

    /// Returns the time from the nominal time of a frame until its picture was taken, in nanoseconds; 0 for cameras without a clock of
    /// their own.
    pub(crate) fn rest_nanos(&self, index: u64) -> i64 {
        self.timeline.map_or(0, |timeline| timeline.rest_nanos(index))
    }

    /// Returns the picture of the last [`Self::step`]: RGB, row major.
    pub(crate) fn pixels(&self) -> &[u8] {
        let fresh = || self.feed.as_ref().map_or(&[][..], Retimed::pixels);
        self.held.as_deref().unwrap_or_else(fresh)
    }

    /// Skips the next `n` frames, or fewer at the end. Returns the number of skipped frames.
    pub(crate) fn skip(&mut self, n: u64) -> u64 {
        let n = n.min(self.info.n_frames.saturating_sub(self.at));
        for _ in 0..n {
            if let Err(error) = self.skip_one() {
                self.lose(&error, 0);
            }
            self.at += 1;
        }
        n
    }

    /// Advances to the next frame.
    ///
    /// * `now`: time in nanoseconds, which decides when a camera is reopened.
    pub(crate) fn step(&mut self, now: u64) -> Step {
        if self.at >= self.info.n_frames {
            self.complain();
            return Step::End;
        }
        let index = self.index();
        let step = match self.read(index, now) {
            Ok(Some(read)) => self.check(index, read),
            Ok(None) => Step::Nothing(self.cause),
            Err(error) => {
                self.lose(&error, now);
                Step::Nothing(self.cause)
            }
        };
        if step == Step::End {
            self.complain();
            return Step::End;
        }
        self.at += 1;
        step
    }

    /// Logs the error messages of the decoder once.
    fn complain(&mut self) {
        let Some(feed) = self.feed.take() else { return };
        let complaints = feed.complaints();
        if complaints.messages > 0 {
            tracing::warn!(
                source = self.spec.path,
                messages = complaints.messages,
                undecoded = complaints.undecoded,
                last = complaints.last,
                "the decoder reported errors in this camera's video; incomplete pictures are left out"
            );
        }
    }

    fn check(&mut self, index: u64, read: Read) -> Step {
        match read {
            Read::Picture(time_s) => {
                // `self.pixels()` is not used here, because it would borrow the guard as well.
                let fresh = self.feed.as_ref().map_or(&[][..], Retimed::pixels);
                let pixels = self.held.as_deref().unwrap_or(fresh);
                let wrong = self.guard.check(index, time_s, pixels);
                wrong.map_or(Step::Picture, Step::Nothing)
            }
            Read::LeftOut => {
                // Frames are missing if a camera is slow, or if a video decoder cannot decode them.
                let is_video = self.feed.as_ref().is_some_and(Retimed::is_video);
                let cause = if is_video {
                    Status::DAMAGED
                } else {
                    Status::LEFT_OUT
                };
                Step::Nothing(cause)
            }
            Read::Over => Step::End,
        }
    }

    /// Reads the next frame; `None` while the camera is gone.
    fn read(&mut self, index: u64, now: u64) -> Result<Option<Read>, FootageError> {
        let fault = self.faults.at(index);
        if fault.is_some_and(|fault| fault.kind == FaultKind::Spin) {
            spin();
        }
        if let Some(error) = fault.and_then(|fault| self.failure(fault)) {
            return Err(error);
        }
        if self.feed.is_none() && !self.reopen(now)? {
            return Ok(None);
        }
        match fault.map(|fault| fault.kind) {
            Some(FaultKind::Freeze) if self.pixels().len() == self.info.size.rgb_bytes() => {
                return self.freeze().map(Some);
            }
            Some(FaultKind::Slow) if self.is_odd(fault, index) => self.skip_one()?,
            _ => {}
        }
        self.held = None;
        let next = match self.early.take() {
            Some(early) => Some(early),
            None => self.next_of_feed()?,
        };
        let Some((found, time_s)) = next else {
            if fault.is_some_and(|fault| fault.kind == FaultKind::Slow) {
                return Ok(Some(Read::LeftOut));
            }
            return self.at_end().map(Some);
        };
        self.n_failures = 0;
        if found > index {
            self.early = Some((found, time_s));
            return Ok(Some(Read::LeftOut));
        }
        Ok(Some(Read::Picture(self.timestamp(fault, index, time_s))))
    }

    fn next_of_feed(&mut self) -> Result<Option<(u64, Option<f64>)>, FootageError> {
        let Some(feed) = &mut self.feed else {
            return Ok(None);
        };
        Ok(feed.next_frame()?.map(|frame| (frame.index, frame.time_s)))
    }

    /// Handles a source that ends early, which is a failure if the camera is live.
    fn at_end(&self) -> Result<Read, FootageError> {
        if !self.is_live {
            return Ok(Read::Over);
        }
        Err(FootageError::NotFound {
            path: self.spec.path.clone(),
        })
    }

    /// Returns the error that a simulated fault causes, if any.
    fn failure(&self, fault: Fault) -> Option<FootageError> {
        let path = || self.spec.path.clone();
        match fault.kind {
            FaultKind::Unplug => Some(FootageError::NotFound { path: path() }),
            FaultKind::Damage => Some(FootageError::Video {
                path: path().into(),
                message: "a simulated fault".to_owned(),
            }),
            FaultKind::Size => {
                let Size { width, height } = self.info.size;
                Some(self.size_differs(Size::new(width / 2, height / 2)))
            }
            _ => None,
        }
    }

    fn size_differs(&self, found: Size) -> FootageError {
        FootageError::SizeDiffers {
            path: self.spec.path.clone().into(),
            found,
            first: self.spec.path.clone().into(),
            expected: self.info.size,
        }
    }

    fn is_odd(&self, fault: Option<Fault>, index: u64) -> bool {
        fault.is_some_and(|fault| (index - fault.from) / self.spec.step % 2 == 1)
    }

    /// Skips a frame of the feed, so that the last picture is repeated.
    fn freeze(&mut self) -> Result<Read, FootageError> {
        if self.held.is_none() {
            self.held = Some(self.pixels().to_vec());
        }
        self.skip_one()?;
        Ok(Read::Picture(None))
    }

    /// Skips the next frame of the feed.
    fn skip_one(&mut self) -> Result<(), FootageError> {
        let index = self.index();
        match self.early {
            Some((found, _)) if found > index => {}
            Some(_) => self.early = None,
            None => {
                if let Some(feed) = &mut self.feed {
                    feed.skip(1)?;
                }
            }
        }
        Ok(())
    }

    /// Returns the timestamp of a frame, with a simulated fault of the clock.
    fn timestamp(&self, fault: Option<Fault>, index: u64, time_s: Option<f64>) -> Option<f64> {
        let rate_hz = self.info.frame_rate_hz? * self.spec.step as f64;
        let at = |index: u64| index as f64 / rate_hz;
        let Some(Fault { kind, from, .. }) = fault else {
            return time_s;
        };
        let before = from.saturating_sub(self.spec.step);
        match kind {
            FaultKind::Repeat => Some(at(before)),
            FaultKind::Back => Some(at(before) - at(index - from + 1)),
            FaultKind::Jump => Some(at(index) + 3600.0 * (index - from + 1) as f64),
            _ => time_s,
        }
    }

    /// Reopens the source at the next frame. Returns `false` if it is too early for that.
    fn reopen(&mut self, now: u64) -> Result<bool, FootageError> {
        if self.is_abandoned || (self.is_live && now < self.retry_at) {
            return Ok(false);
        }
        let spec = SourceSpec {
            start: self.index(),
            count: Some(self.info.n_frames - self.at),
            ..self.spec.clone()
        };
        let feed = match Retimed::open(&spec, self.timeline.as_ref()) {
            Ok(feed) => feed,
            Err(FeedError::Footage(error)) => return Err(error),
            // A scene could be created before, so creating it again fails only if its files have been removed.
            Err(
                FeedError::Address { address, .. }
                | FeedError::Blank { address, .. }
                | FeedError::Recorded { address, .. }
                | FeedError::Scene { address, .. },
            ) => {
                return Err(FootageError::NotFound { path: address });
            }
        };
        let size = feed.info().size;
        if size != self.info.size {
            return Err(self.size_differs(size));
        }
        self.feed = Some(feed);
        Ok(true)
    }

    /// Records a failure, and closes the source, whose position is then unknown.
    fn lose(&mut self, error: &FootageError, now: u64) {
        let cause = cause_of(error);
        if self.feed.is_some() || self.cause != cause {
            tracing::error!(
                frame = self.index(),
                error = failure::wording::in_one_line(error),
                "no picture from this camera"
            );
        }
        (self.feed, self.early, self.held) = (None, None, None);
        self.cause = cause;
        self.retry_at = now + PAUSE_NANOS;
        let is_on_purpose = self.faults.at(self.index()).is_some();
        self.n_failures = self.n_failures.saturating_add(u32::from(!is_on_purpose));
        let is_too_often = !self.is_live && self.n_failures >= MAX_FAILURES;
        self.is_abandoned |= is_too_often || matches!(error, FootageError::VideoTruncated { .. });
    }
}

/// Never returns, like a process that is stuck in a computation.
fn spin() -> ! {
    tracing::warn!("injected fault: this process now loops forever");
    loop {
        core::hint::spin_loop();
    }
}

/// Result of reading from a camera.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Read {
    /// A picture, with its timestamp in seconds.
    Picture(Option<f64>),
    /// The frame is missing, because the camera is already at a later one.
    LeftOut,
    /// The end of the footage.
    Over,
}

fn cause_of(error: &FootageError) -> Status {
    match error {
        FootageError::SizeDiffers { .. } => Status::WRONG_SIZE,
        FootageError::Image { .. }
        | FootageError::Empty { .. }
        | FootageError::Video { .. }
        | FootageError::VideoTruncated { .. } => Status::DAMAGED,
        _ => Status::UNPLUGGED,
    }
}
