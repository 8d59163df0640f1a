//! One picture after the other from a camera that may fail: opened again when it comes back, and looked at.

#[cfg(test)]
mod tests;

use footage::{FootageError, Size, SourceSpec};
use messages::Status;

use crate::fault::{Fault, FaultKind, Faults};
use crate::feed::{Feed, FeedError, FeedInfo};
use crate::guard::Guard;

/// A camera that is gone is looked for again after so long, nanoseconds.
const PAUSE_NANOS: u64 = 500_000_000;
/// Footage that nobody paces cannot come back by itself: it is given up after so many failures in a row.
const MOST_FAILURES: u32 = 3;

/// What there is of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Step {
    /// Its picture: [`Supply::pixels`].
    Picture,
    /// No picture, and why.
    Nothing(Status),
    /// There are no more frames.
    End,
}

/// The frames of a camera in their order, every one of which is answered.
#[derive(Debug)]
pub(crate) struct Supply {
    spec: SourceSpec,
    faults: Faults,
    info: FeedInfo,
    /// Whether the frames are those of a clock, so that a camera may come back.
    is_live: bool,
    feed: Option<Feed>,
    /// Which frame comes next, of those that are used.
    at: u64,
    /// Index of a frame that has been read before its turn, and its time.
    early: Option<(u64, Option<f64>)>,
    /// A picture that stays, while it does.
    held: Option<Vec<u8>>,
    guard: Guard,
    /// Why there is no picture, once there is none.
    cause: Status,
    n_failures: u32,
    retry_at: u64,
    is_given_up: bool,
}

impl Supply {
    /// Opens the footage or makes the scene.
    ///
    /// * `is_live`: a clock runs, and a camera that is gone may come back.
    /// * `frozen_after`: see [`crate::Config::frozen_after`].
    ///
    /// # Errors
    ///
    /// [`FeedError`]: a camera that is not there at the beginning is a mistake in the deployment.
    pub(crate) fn open(
        spec: &SourceSpec,
        faults: &Faults,
        is_live: bool,
        frozen_after: u32,
    ) -> Result<Self, FeedError> {
        let feed = Feed::open(spec)?;
        let info = feed.info();
        let rate_hz = info.frame_rate_hz.map(|it| it * spec.step as f64);
        let frozen_after = if feed.is_still() { 0 } else { frozen_after };
        Ok(Self {
            spec: spec.clone(),
            faults: faults.clone(),
            info,
            is_live,
            feed: Some(feed),
            at: 0,
            early: None,
            held: None,
            guard: Guard::new(frozen_after, rate_hz),
            cause: Status::NO_FRAME,
            n_failures: 0,
            retry_at: 0,
            is_given_up: false,
        })
    }

    /// What is known of the pictures.
    pub(crate) fn info(&self) -> FeedInfo {
        self.info
    }

    /// Index in the footage of the frame that comes next.
    pub(crate) fn index(&self) -> u64 {
        self.index_of(self.at)
    }

    fn index_of(&self, nth: u64) -> u64 {
        let offset = nth.saturating_mul(self.spec.step);
        self.spec.start.saturating_add(offset)
    }

    /// The picture that [`Self::step`] has found, RGB, row major.
    pub(crate) fn pixels(&self) -> &[u8] {
        let fresh = || self.feed.as_ref().map_or(&[][..], Feed::pixels);
        self.held.as_deref().unwrap_or_else(fresh)
    }

    /// Passes over the next `n` frames, and returns how many there were.
    pub(crate) fn skip(&mut self, n: u64) -> u64 {
        let n = n.min(self.info.n_frames.saturating_sub(self.at));
        for _ in 0..n {
            if let Err(error) = self.pass() {
                self.lose(&error, 0);
            }
            self.at += 1;
        }
        n
    }

    /// Goes on to the next frame.
    ///
    /// * `now`: nanoseconds, to tell when a camera is looked for again.
    pub(crate) fn step(&mut self, now: u64) -> Step {
        if self.at >= self.info.n_frames {
            return Step::End;
        }
        let index = self.index();
        let step = match self.read(index, now) {
            Ok(Some(given)) => self.judge(index, given),
            Ok(None) => Step::Nothing(self.cause),
            Err(error) => {
                self.lose(&error, now);
                Step::Nothing(self.cause)
            }
        };
        if step == Step::End {
            return Step::End;
        }
        self.at += 1;
        step
    }

    fn judge(&mut self, index: u64, given: Given) -> Step {
        match given {
            Given::Time(time_s) => {
                // Not `self.pixels()`, which would borrow the guard as well.
                let fresh = self.feed.as_ref().map_or(&[][..], Feed::pixels);
                let pixels = self.held.as_deref().unwrap_or(fresh);
                let wrong = self.guard.look(index, time_s, pixels);
                wrong.map_or(Step::Picture, Step::Nothing)
            }
            Given::LeftOut => {
                // A camera leaves frames out for want of time, a decoder those that it cannot read.
                let is_video = self.feed.as_ref().is_some_and(Feed::is_video);
                let cause = if is_video {
                    Status::DAMAGED
                } else {
                    Status::LEFT_OUT
                };
                Step::Nothing(cause)
            }
            Given::Over => Step::End,
        }
    }

    /// What the camera gives; nothing while it is gone.
    fn read(&mut self, index: u64, now: u64) -> Result<Option<Given>, FootageError> {
        let fault = self.faults.at(index);
        if fault.is_some_and(|it| it.kind == FaultKind::Spin) {
            spin();
        }
        if let Some(error) = fault.and_then(|it| self.failure(it)) {
            return Err(error);
        }
        if self.feed.is_none() && !self.open_again(now)? {
            return Ok(None);
        }
        match fault.map(|it| it.kind) {
            Some(FaultKind::Freeze) if self.pixels().len() == self.info.size.rgb_bytes() => {
                return self.freeze().map(Some);
            }
            Some(FaultKind::Slow) if self.is_odd(fault, index) => self.pass()?,
            _ => {}
        }
        self.held = None;
        let next = match self.early.take() {
            Some(early) => Some(early),
            None => self.next_of_feed()?,
        };
        let Some((found, time_s)) = next else {
            if fault.is_some_and(|it| it.kind == FaultKind::Slow) {
                return Ok(Some(Given::LeftOut));
            }
            return self.at_end().map(Some);
        };
        self.n_failures = 0;
        if found > index {
            self.early = Some((found, time_s));
            return Ok(Some(Given::LeftOut));
        }
        Ok(Some(Given::Time(self.told(fault, index, time_s))))
    }

    fn next_of_feed(&mut self) -> Result<Option<(u64, Option<f64>)>, FootageError> {
        let Some(feed) = &mut self.feed else {
            return Ok(None);
        };
        Ok(feed.next_frame()?.map(|it| (it.index, it.time_s)))
    }

    /// Footage that ends before its time ends; of a live camera that is a failure.
    fn at_end(&self) -> Result<Given, FootageError> {
        if !self.is_live {
            return Ok(Given::Over);
        }
        Err(FootageError::NotFound {
            path: self.spec.path.clone(),
        })
    }

    /// The failure that a fault is, if it is one.
    fn failure(&self, fault: Fault) -> Option<FootageError> {
        let path = || self.spec.path.clone();
        match fault.kind {
            FaultKind::Unplug => Some(FootageError::NotFound { path: path() }),
            FaultKind::Damage => Some(FootageError::Video {
                path: path().into(),
                message: "a fault on purpose".to_owned(),
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
        fault.is_some_and(|it| (index - it.from) / self.spec.step % 2 == 1)
    }

    /// Passes a frame by and stays with the last picture.
    fn freeze(&mut self) -> Result<Given, FootageError> {
        if self.held.is_none() {
            self.held = Some(self.pixels().to_vec());
        }
        self.pass()?;
        Ok(Given::Time(None))
    }

    /// Passes over the frame that comes next.
    fn pass(&mut self) -> Result<(), FootageError> {
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

    /// The time that the camera says, under a fault of its clock.
    fn told(&self, fault: Option<Fault>, index: u64, time_s: Option<f64>) -> Option<f64> {
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

    /// Opens the footage again where the next frame is; `false` if that is to wait.
    fn open_again(&mut self, now: u64) -> Result<bool, FootageError> {
        if self.is_given_up || (self.is_live && now < self.retry_at) {
            return Ok(false);
        }
        let spec = SourceSpec {
            start: self.index(),
            count: Some(self.info.n_frames - self.at),
            ..self.spec.clone()
        };
        let feed = match Feed::open(&spec) {
            Ok(feed) => feed,
            Err(FeedError::Footage(error)) => return Err(error),
            // A scene that could be made once can be made again, but for its files.
            Err(FeedError::Address { address, .. } | FeedError::Scene { address, .. }) => {
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

    /// Notes that the camera has failed: what it would give next nobody knows.
    fn lose(&mut self, error: &FootageError, now: u64) {
        let cause = cause_of(error);
        if self.feed.is_some() || self.cause != cause {
            tracing::error!(
                frame = self.index(),
                error = causes::in_one_line(error),
                "no picture from this camera"
            );
        }
        (self.feed, self.early, self.held) = (None, None, None);
        self.cause = cause;
        self.retry_at = now + PAUSE_NANOS;
        let is_on_purpose = self.faults.at(self.index()).is_some();
        self.n_failures = self.n_failures.saturating_add(u32::from(!is_on_purpose));
        let is_too_often = !self.is_live && self.n_failures >= MOST_FAILURES;
        self.is_given_up |= is_too_often || matches!(error, FootageError::VideoTruncated { .. });
    }
}

/// Never comes back, as a process that hangs in a computation.
fn spin() -> ! {
    tracing::warn!("computing for ever, on purpose");
    loop {
        core::hint::spin_loop();
    }
}

/// What a camera gives that is there.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Given {
    /// A picture, and the time that the camera says of it, seconds.
    Time(Option<f64>),
    /// It has gone on to a later frame.
    LeftOut,
    /// Nothing any more.
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
