//! The thread that keeps a live camera open, and the newest pictures of the camera.

use core::time::Duration;
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _};
use footage::{Size, StreamEnd};
use messages::{Status, TimedBy};

use super::address::{LiveCamera, LiveError};
use super::input::{Input, Taken};
use super::originals::Originals;

/// Maximum number of waiting pictures. A new picture replaces the oldest one, so the picture in use is never more than this many pictures
/// old.
const N_WAITING: usize = 4;
/// Minimum number of pictures before a rate is reported.
const LEAST_FOR_RATE: u64 = 30;
/// Time without a picture after which a decoder is stopped, if it has no time limit of its own or exceeds it.
const LONGEST_SILENCE: Duration = Duration::from_secs(15);
/// First pause before a camera is opened again.
const FIRST_PAUSE: Duration = Duration::from_millis(500);
/// Longest pause after further failures.
const LONGEST_PAUSE: Duration = Duration::from_secs(8);

/// A picture that waits to be used.
#[derive(Debug)]
pub(crate) struct Picture {
    /// Pixels of the picture, row major.
    pub rgb: Vec<u8>,
    /// Time at which the picture was taken, by `CLOCK_MONOTONIC`, in nanoseconds.
    pub at_nanos: u64,
    /// Time at which the picture arrived.
    pub arrived_at_nanos: u64,
    /// Number of earlier pictures that this picture has overtaken, because this process was slow.
    pub n_overtaken: u64,
    /// Clock by which the time of the picture was measured.
    pub timed_by: TimedBy,
}

/// Counts of all pictures so far.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Tally {
    pub n_connections: u64,
    /// Number of pictures that the camera lost, and number that it delivered. The latter includes overtaken and damaged pictures.
    pub n_lost: u64,
    pub n_delivered: u64,
    pub n_overtaken: u64,
    pub n_damaged: u64,
    /// Pictures per second since the camera was opened.
    pub rate_hz: Option<f64>,
    /// [`Taken::timed_by`] and [`Taken::delay_nanos`] of the last picture.
    pub timed_by: TimedBy,
    pub delay_nanos: Option<i64>,
}

#[derive(Debug, Default)]
struct State {
    waiting: VecDeque<Picture>,
    spare: Vec<Vec<u8>>,
    /// Number of pictures that were overtaken since the last picture was taken from the queue.
    n_overtaken: u64,
    tally: Tally,
    /// Reason why there are no pictures; `None` while the camera is open, or is being opened for the first time.
    trouble: Option<Status>,
    /// Handle that ends the wait for a stream, and time at which the wait began.
    end: Option<StreamEnd>,
    waits_since: Option<Instant>,
    is_over: bool,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    news: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A camera that a separate thread opens, and reopens after failures, until this value is dropped.
#[derive(Debug)]
pub(crate) struct Source {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Source {
    /// Starts the thread.
    ///
    /// * `size`: size of the pictures, before they are shrunk. Another size counts as a failure of the camera.
    /// * `originals`: queue for original pictures, if they are to be kept.
    pub(crate) fn start(
        camera: &LiveCamera,
        size: Size,
        originals: Option<Arc<Originals>>,
    ) -> Result<Self, Failure> {
        let shared = Arc::new(Shared::default());
        let keeper = Keeper {
            shared: Arc::clone(&shared),
            camera: camera.clone(),
            size,
            originals,
        };
        let thread = thread::Builder::new().name("live camera".to_owned());
        let thread = thread.spawn(move || keeper.keep_open()).or_fail(ExitKind::Run)?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Returns the oldest waiting picture; `None` if no picture arrives within `patience`.
    pub(crate) fn next(&self, patience: Duration) -> Option<Picture> {
        let state = self.shared.state();
        let is_empty = |state: &mut State| state.waiting.is_empty();
        let waited = self.shared.news.wait_timeout_while(state, patience, is_empty);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let is_silent = |instant: Instant| instant.elapsed() > LONGEST_SILENCE;
        if state.waits_since.is_some_and(is_silent)
            && let Some(end) = state.end.take()
        {
            end.end();
        }
        let mut picture = state.waiting.pop_front()?;
        picture.n_overtaken = core::mem::take(&mut state.n_overtaken);
        Some(picture)
    }

    /// Returns a picture whose memory can be used again.
    pub(crate) fn give_back(&self, picture: Picture) {
        self.shared.state().spare.push(picture.rgb);
    }

    /// Returns the reason why there are no pictures, if the camera is known to have failed.
    pub(crate) fn trouble(&self) -> Option<Status> {
        self.shared.state().trouble
    }

    pub(crate) fn tally(&self) -> Tally {
        self.shared.state().tally
    }
}

impl Drop for Source {
    fn drop(&mut self) {
        let end = {
            let mut state = self.shared.state();
            state.is_over = true;
            state.end.take()
        };
        self.shared.news.notify_all();
        if let Some(end) = end {
            end.end();
        }
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::debug!("the thread of the camera has panicked");
        }
    }
}

/// State of the thread that keeps the camera open.
struct Keeper {
    shared: Arc<Shared>,
    camera: LiveCamera,
    size: Size,
    originals: Option<Arc<Originals>>,
}

impl Keeper {
    fn keep_open(self) {
        let (mut pause, mut before) = (FIRST_PAUSE, None);
        let mut is_bare = false;
        let mut said: Option<Status> = None;
        while !self.shared.state().is_over {
            let mut n_read = 0;
            let originals = self.originals.as_ref();
            let (camera, size) = (&self.camera, self.size);
            let failed = match Input::open(camera, size, before.as_ref(), originals, is_bare) {
                Ok(mut input) => {
                    before = input.about().or(before);
                    self.read_all(&mut input, &mut n_read)
                }
                Err(error) => Some(error),
            };
            let Some(error) = failed else { return };
            let status = error.status();
            // It is only known after an attempt if the camera sends a boundary before its first picture.
            let is_tried = self.camera.is_http() && n_read == 0;
            is_bare ^= is_tried;
            if is_tried && is_bare && said.is_none() {
                tracing::debug!(camera = %self.camera.address, %error, "reading the stream again, without a boundary before the first \
                                                                        picture");
                continue;
            }
            if n_read > 0 || said != Some(status) {
                let error = failure::wording::in_one_line(&error);
                tracing::error!(camera = %self.camera.address, error, "no picture from this camera");
            }
            said = Some(status);
            if n_read > 0 {
                pause = FIRST_PAUSE;
            }
            self.rest(status, pause);
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }

    /// Reads until the camera fails. Returns no error if the camera is no longer needed.
    fn read_all(&self, input: &mut Input, n_read: &mut u64) -> Option<LiveError> {
        {
            let mut state = self.shared.state();
            if state.is_over {
                return None;
            }
            state.end = input.end();
            state.waits_since = Some(Instant::now());
        }
        if let Some(originals) = &self.originals {
            originals.connected();
        }
        let mut spare = None;
        let (mut pace, mut is_own_time) = (Pace::default(), false);
        loop {
            let mut rgb = spare.take().unwrap_or_else(|| self.room());
            let read = input.next(&mut rgb);
            if self.shared.state().is_over {
                return None;
            }
            match read {
                Ok(None) => spare = Some(rgb),
                Ok(Some(taken)) => {
                    // A decoder that has just started has not found its camera yet.
                    if *n_read == 0 {
                        self.shared.state().tally.n_connections += 1;
                    }
                    *n_read += 1;
                    // The rate is measured again if the times are from another clock.
                    if is_own_time != (taken.timed_by == TimedBy::CAMERA) {
                        (pace, is_own_time) = (Pace::default(), !is_own_time);
                    }
                    let made = 1 + taken.n_lost + taken.n_overtaken;
                    let rate_hz = pace.rate_hz(made, taken.at_nanos);
                    spare = self.post(taken, rgb, rate_hz);
                }
                Err(error) => return Some(error),
            }
        }
    }

    /// Returns memory for a picture.
    fn room(&self) -> Vec<u8> {
        let spare = self.shared.state().spare.pop();
        let mut rgb = spare.unwrap_or_default();
        let delivered = self.size.shrunk(self.camera.shrink(self.size));
        rgb.resize(delivered.rgb_bytes(), 0);
        rgb
    }

    /// Puts a picture into the queue. Returns memory that is no longer needed.
    fn post(&self, taken: Taken, rgb: Vec<u8>, rate_hz: Option<f64>) -> Option<Vec<u8>> {
        let mut state = self.shared.state();
        state.trouble = None;
        state.waits_since = Some(Instant::now());
        let tally = &mut state.tally;
        tally.n_delivered += 1 + taken.n_overtaken;
        tally.n_lost += taken.n_lost;
        tally.n_overtaken += taken.n_overtaken;
        tally.rate_hz = rate_hz;
        (tally.timed_by, tally.delay_nanos) = (taken.timed_by, taken.delay_nanos);
        if !taken.is_whole {
            tally.n_damaged += 1;
            return Some(rgb);
        }
        state.waiting.push_back(Picture {
            rgb,
            at_nanos: taken.at_nanos,
            arrived_at_nanos: taken.arrived_at_nanos,
            n_overtaken: 0,
            timed_by: taken.timed_by,
        });
        state.n_overtaken += taken.n_overtaken;
        let overtaken = if state.waiting.len() > N_WAITING {
            state.n_overtaken += 1;
            state.tally.n_overtaken += 1;
            state.waiting.pop_front().map(|waiting| waiting.rgb)
        } else {
            None
        };
        drop(state);
        self.shared.news.notify_one();
        overtaken
    }

    /// Reports why there are no pictures, and waits before the next attempt.
    fn rest(&self, status: Status, pause: Duration) {
        let mut state = self.shared.state();
        state.trouble = Some(status);
        state.end = None;
        let goes_on = |state: &mut State| !state.is_over;
        let waited = self.shared.news.wait_timeout_while(state, pause, goes_on);
        drop(waited);
    }
}

/// Measures the rate of a camera by its own times, since it was opened.
#[derive(Debug, Default)]
struct Pace {
    first_nanos: Option<u64>,
    n: u64,
}

impl Pace {
    /// Adds a picture, and returns the rate if it is known.
    ///
    /// * `n_made`: number of pictures since the previous call, including this one.
    fn rate_hz(&mut self, n_made: u64, at_nanos: u64) -> Option<f64> {
        let Some(first) = self.first_nanos else {
            self.first_nanos = Some(at_nanos);
            return None;
        };
        self.n += n_made;
        if self.n < LEAST_FOR_RATE {
            return None;
        }
        let seconds =
            at_nanos.checked_sub(first).filter(|difference| *difference > 0)? as f64 * 1e-9;
        Some(self.n as f64 / seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(n_lost: u64, is_whole: bool) -> Taken {
        Taken {
            at_nanos: 1,
            arrived_at_nanos: 2,
            n_lost,
            n_overtaken: 0,
            is_whole,
            timed_by: TimedBy::DRIVER,
            delay_nanos: None,
        }
    }

    fn keeper() -> Keeper {
        let address = footage::LiveAddress::Device("/dev/null".into());
        Keeper {
            shared: Arc::default(),
            camera: LiveCamera::new(address),
            size: Size::new(1, 1),
            originals: None,
        }
    }

    #[test]
    fn the_oldest_picture_is_dropped_if_the_queue_is_full_and_every_picture_is_counted() {
        let keeper = keeper();
        for nth in 0..N_WAITING as u8 + 3 {
            keeper.post(taken(u64::from(nth % 2), true), vec![nth; 3], None);
        }
        keeper.post(taken(0, false), vec![99; 3], None);
        let source = Source {
            shared: Arc::clone(&keeper.shared),
            thread: None,
        };
        let first = source.next(Duration::ZERO).unwrap();
        assert_eq!((first.rgb[0], first.n_overtaken), (3, 3));
        let mut n = 1;
        while let Some(picture) = source.next(Duration::ZERO) {
            assert_eq!(picture.n_overtaken, 0, "told once");
            n += 1;
        }
        let tally = source.tally();
        assert_eq!((tally.n_delivered, tally.n_lost), (N_WAITING as u64 + 4, 3));
        assert_eq!(n + tally.n_overtaken + tally.n_damaged, tally.n_delivered);
    }

    #[test]
    fn a_missing_camera_is_reported_and_dropping_the_source_ends_its_thread() {
        let source = Source::start(&keeper().camera, Size::new(1, 1), None).unwrap();
        while source.trouble().is_none() {
            assert!(source.next(Duration::from_millis(10)).is_none());
        }
        assert_eq!(source.trouble(), Some(Status::UNPLUGGED));
        assert_eq!(source.tally().n_connections, 0);
        drop(source);
    }

    #[test]
    fn the_rate_is_known_after_enough_pictures() {
        let mut pace = Pace::default();
        let rates = (0..100_u64).map(|nth| pace.rate_hz(1, nth * 40_000_000));
        let rates: Vec<Option<f64>> = rates.collect();
        assert_eq!(rates[20], None);
        assert!((rates[99].unwrap() - 25.0).abs() < 1e-9);
    }
}
