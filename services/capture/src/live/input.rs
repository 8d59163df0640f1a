//! An open live camera: a video device or a stream.

use core::time::Duration;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{SystemTime, UNIX_EPOCH};

use failure::now_nanos;
use footage::{LiveAddress, LiveStream, PixelFormat, Size, StreamEnd, StreamSpec};
use messages::TimedBy;
use runtime::{VideoAbout, VideoDevice, VideoStream, video_devices};

use super::address::{LiveCamera, LiveError, size_of};
use super::clock::{ClockMap, OwnClock, Verdict};
use super::originals::{KeptStream, Original, Originals};

/// Longest wait for a picture of a device, so that a stop request is noticed.
const PAUSE: Duration = Duration::from_millis(100);
/// Time without a picture after which a device is opened again, in nanoseconds.
const SILENCE_NANOS: u64 = 5_000_000_000;
/// Minimum gap between two times of a stream at which pictures count as missing, in periods.
const GAP: f64 = 1.5;

/// One picture read from a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Taken {
    /// Time at which the picture was taken, by `CLOCK_MONOTONIC`, in nanoseconds.
    pub at_nanos: u64,
    /// Time at which the picture arrived.
    pub arrived_at_nanos: u64,
    /// Number of pictures before this picture that the camera lost.
    pub n_lost: u64,
    /// Number of pictures before this picture that were lost because this process was slow and no buffer was free.
    pub n_overtaken: u64,
    /// True if the pixels are valid.
    pub is_whole: bool,
    /// Clock by which the time of the picture was measured.
    pub timed_by: TimedBy,
    /// Shortest delay of the pictures by the camera's own clock, in nanoseconds, even if that clock is not trusted; `None` if unknown.
    pub delay_nanos: Option<i64>,
}

/// An open camera.
#[derive(Debug)]
pub(super) enum Input {
    Device(Box<Device>),
    Stream(Box<Stream>),
}

impl Input {
    /// Opens a camera.
    ///
    /// * `before`: the device that was open before. Its device number may have changed since.
    /// * `originals`: queue for original pictures, if they are to be kept.
    /// * `is_bare`: see [`StreamSpec::is_bare`].
    pub(super) fn open(
        camera: &LiveCamera,
        size: Size,
        before: Option<&VideoAbout>,
        originals: Option<&Arc<Originals>>,
        is_bare: bool,
    ) -> Result<Self, LiveError> {
        match &camera.address {
            LiveAddress::Device(path) => {
                let device = Device::open(camera, path, size, before, originals)?;
                Ok(Self::Device(Box::new(device)))
            }
            LiveAddress::Stream(address) => Ok(Self::Stream(Box::new(Stream {
                decoder: StreamSpec {
                    keeps: originals.is_some(),
                    is_bare,
                    ..camera.stream(address)
                }
                .open(size)?,
                kept: originals.map(|original| KeptStream::new(Arc::clone(original), size)),
                clock: ClockMap::default(),
                own_clock: camera.has_own_clock.then(OwnClock::default),
                address: camera.address.to_string(),
                period_nanos: camera.rate_hz.map(|rate_hz| 1e9 / rate_hz),
                last: None,
            }))),
        }
    }

    /// Returns the properties by which the device is recognised when it is connected again.
    pub(super) fn about(&self) -> Option<VideoAbout> {
        match self {
            Self::Device(it) => Some(it.about.clone()),
            Self::Stream(_) => None,
        }
    }

    /// Returns a handle with which another thread can make this input stop waiting for a picture.
    pub(super) fn end(&self) -> Option<StreamEnd> {
        match self {
            Self::Device(_) => None,
            Self::Stream(it) => Some(it.decoder.end()),
        }
    }

    /// Reads the next picture into `rgb`. Returns `None` if no picture has arrived yet.
    pub(super) fn next(&mut self, rgb: &mut [u8]) -> Result<Option<Taken>, LiveError> {
        match self {
            Self::Device(it) => it.next(rgb),
            Self::Stream(it) => it.next(rgb).map(Some),
        }
    }
}

/// An open video device.
#[derive(Debug)]
pub(super) struct Device {
    stream: VideoStream,
    format: PixelFormat,
    size: Size,
    about: VideoAbout,
    last_sequence: Option<u32>,
    was_full: bool,
    last_nanos: u64,
    originals: Option<Arc<Originals>>,
}

impl Device {
    fn open(
        camera: &LiveCamera,
        path: &Path,
        size: Size,
        before: Option<&VideoAbout>,
        originals: Option<&Arc<Originals>>,
    ) -> Result<Self, LiveError> {
        let device = match before {
            None => VideoDevice::open(path)?,
            Some(about) => again(path, about)?,
        };
        let wanted = [size.width as u32, size.height as u32];
        let (mode, format) = camera.set(&device, Some(wanted))?;
        let about = device.about()?;
        Ok(Self {
            stream: device.start()?,
            format,
            size: size_of(mode),
            about,
            last_sequence: None,
            was_full: false,
            last_nanos: now_nanos(),
            originals: originals.cloned(),
        })
    }

    fn next(&mut self, rgb: &mut [u8]) -> Result<Option<Taken>, LiveError> {
        let stride = self.stream.mode().bytes_per_row as usize;
        let Some(picture) = self.stream.next(PAUSE)? else {
            if now_nanos() - self.last_nanos > SILENCE_NANOS {
                let address = self.stream.device().path().display().to_string();
                return Err(LiveError::Silent { address });
            }
            return Ok(None);
        };
        let arrived_at_nanos = now_nanos();
        let n_missing = missing(self.last_sequence, picture.sequence);
        let is_ours = self.was_full;
        (self.last_sequence, self.was_full) = (Some(picture.sequence), picture.was_full);
        self.last_nanos = arrived_at_nanos;
        let is_whole =
            !picture.is_damaged && self.format.to_rgb(picture.bytes, stride, self.size, rgb);
        let (at_nanos, timed_by) =
            picture.at_nanos.map_or((arrived_at_nanos, TimedBy::ARRIVAL), |at_nano| {
                (at_nano, TimedBy::DRIVER)
            });
        if let Some(originals) = &self.originals {
            originals.put(Original {
                format: self.format.letters(),
                bytes: picture.bytes.to_vec(),
                at_nanos,
                arrived_at_nanos,
                sequence: u64::from(picture.sequence),
                presented_nanos: 0,
                bytes_per_row: stride as u32,
                size: self.size,
                is_whole,
                connection: 0,
            });
        }
        Ok(Some(Taken {
            at_nanos,
            arrived_at_nanos,
            n_lost: if is_ours { 0 } else { n_missing },
            n_overtaken: if is_ours { n_missing } else { 0 },
            is_whole,
            timed_by,
            delay_nanos: None,
        }))
    }
}

/// Returns how many numbers are missing between two picture numbers; 0 if the camera has restarted its count.
fn missing(last: Option<u32>, now: u32) -> u64 {
    let gap = last.map_or(1, |last| now.wrapping_sub(last));
    let is_ahead = (1..1 << 31).contains(&gap);
    if is_ahead { u64::from(gap - 1) } else { 0 }
}

/// Opens a camera that was open before, at the same path or under its new number.
fn again(path: &Path, about: &VideoAbout) -> Result<VideoDevice, LiveError> {
    let there = VideoDevice::open(path);
    if let Ok(device) = &there
        && device.about()? == *about
    {
        return Ok(there?);
    }
    let others: Vec<PathBuf> = video_devices().unwrap_or_default();
    for other in others.into_iter().filter(|other| other != path) {
        let Ok(device) = VideoDevice::open(&other) else {
            continue;
        };
        if device.about().is_ok_and(|found| found == *about) {
            tracing::warn!(was = %path.display(), now = %other.display(), "this camera has a new device number");
            return Ok(device);
        }
    }
    let found = there?.about()?;
    let shown = |video_about: &VideoAbout| format!("{} at {}", video_about.card, video_about.bus);
    Err(LiveError::Another {
        address: path.display().to_string(),
        found: shown(&found),
        expected: shown(about),
    })
}

/// A network stream.
#[derive(Debug)]
pub(super) struct Stream {
    decoder: LiveStream,
    kept: Option<KeptStream>,
    clock: ClockMap,
    /// The clock of a camera that writes time stamps into its stream; `None` if these are not used.
    own_clock: Option<OwnClock>,
    /// Address without a password.
    address: String,
    period_nanos: Option<f64>,
    last: Option<i64>,
}

impl Stream {
    fn next(&mut self, rgb: &mut [u8]) -> Result<Taken, LiveError> {
        let frame = self.decoder.next_into(rgb)?;
        let arrived_at_nanos = now_nanos();
        let mut taken = Taken {
            at_nanos: arrived_at_nanos,
            arrived_at_nanos,
            n_lost: 0,
            n_overtaken: 0,
            is_whole: true,
            timed_by: TimedBy::ARRIVAL,
            delay_nanos: None,
        };
        if let Some(presented) = frame.presented_nanos {
            let last = self.last.replace(presented);
            let gap = last.map_or(0, |last| presented.saturating_sub(last));
            taken.n_lost =
                self.period_nanos.map_or(0, |period_nano| missing_by_time(gap, period_nano));
            taken.at_nanos = self.clock.taken_at(presented, arrived_at_nanos);
        }
        if let (Some(unix), Some(clock)) = (frame.unix_nanos, &mut self.own_clock) {
            let before = clock.verdict;
            if let Some(at_nanos) = clock.taken_at([unix, unix_nanos()], arrived_at_nanos) {
                taken.at_nanos = at_nanos;
            }
            taken.timed_by = match clock.verdict {
                Verdict::Unknown => TimedBy::ARRIVAL,
                Verdict::Right => TimedBy::CAMERA,
                Verdict::Wrong => TimedBy::DISBELIEVED,
            };
            taken.delay_nanos = (clock.verdict != Verdict::Unknown).then_some(clock.delay_nanos);
            if clock.verdict != before {
                say_of_clock(clock, &self.address);
            }
        }
        if let (Some(kept), Some(pieces)) = (&mut self.kept, self.decoder.pieces()) {
            kept.decoded(frame.label_nanos, taken.at_nanos);
            kept.put_all(pieces, arrived_at_nanos);
        }
        Ok(taken)
    }
}

/// Logs whether the clock of a camera is trusted.
fn say_of_clock(clock: &OwnClock, camera: &str) {
    let delay_ms = clock.delay_nanos as f64 * 1e-6;
    if clock.verdict == Verdict::Right {
        tracing::info!(
            camera,
            delay_ms,
            "this camera states when its pictures were taken"
        );
    } else {
        tracing::warn!(
            camera,
            delay_ms,
            "according to this camera's clock, its pictures arrive before they are taken, or too late to be used; their arrival times are \
             used as capture times instead; synchronise the camera and this machine with the same time server"
        );
    }
}

/// Returns the time of this machine's clock, in nanoseconds since the beginning of 1970; 0 for earlier times.
fn unix_nanos() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    i64::try_from(since.unwrap_or_default().as_nanos()).unwrap_or(i64::MAX)
}

/// Returns how many pictures are missing in a gap between two pictures. The gap is given in nanoseconds.
fn missing_by_time(gap: i64, period: f64) -> u64 {
    let periods = gap as f64 / period;
    if periods > GAP {
        (periods - 1.0).round() as u64
    } else {
        0
    }
}

/// Opens a live camera, and returns one picture: RGB, row major. It is the first complete picture after `n_skipped` pictures, in which
/// the exposure can settle.
///
/// # Errors
///
/// Fails with [`LiveError`] if the camera cannot be used, or no picture comes.
pub fn take_picture(camera: &LiveCamera, n_skipped: usize) -> Result<(Size, Vec<u8>), LiveError> {
    let (size, _) = camera.look()?;
    let rgb = settled_picture(camera, size, n_skipped, false);
    let rgb = match rgb {
        Err(error) if camera.is_http() => {
            settled_picture(camera, size, n_skipped, true).map_err(|_no_picture| error)?
        }
        rgb => rgb?,
    };
    Ok((size, rgb))
}

fn settled_picture(
    camera: &LiveCamera,
    size: Size,
    n_skipped: usize,
    is_bare: bool,
) -> Result<Vec<u8>, LiveError> {
    let mut input = Input::open(camera, size, None, None, is_bare)?;
    let _watched = input.end().map(Watched::new);
    let mut rgb = vec![0; size.rgb_bytes()];
    let mut n_whole = 0;
    loop {
        let taken = input.next(&mut rgb)?;
        n_whole += usize::from(taken.is_some_and(|taken| taken.is_whole));
        if n_whole > n_skipped {
            return Ok(rgb);
        }
    }
}

/// Ends a stream that is silent for too long. Stops watching when dropped.
#[derive(Debug)]
#[expect(
    dead_code,
    reason = "the other thread waits until this value is dropped"
)]
struct Watched(Option<SyncSender<()>>);

impl Watched {
    fn new(end: StreamEnd) -> Self {
        const LONGEST: Duration = Duration::from_secs(30);
        let (done, over) = sync_channel(1);
        let thread = thread::Builder::new().spawn(move || {
            if over.recv_timeout(LONGEST) == Err(RecvTimeoutError::Timeout) {
                end.end();
            }
        });
        Self(thread.ok().map(|_detached| done))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_skipped_frame_number_counts_as_missing() {
        assert_eq!(missing(None, 17), 0);
        assert_eq!(missing(Some(17), 18), 0);
        assert_eq!(missing(Some(17), 21), 3);
        assert_eq!(missing(Some(u32::MAX), 1), 1, "beyond the last number");
        assert_eq!(missing(Some(17), 0), 0, "it counts anew");
        assert_eq!(missing(Some(17), 17), 0);
    }

    #[test]
    fn gaps_in_a_stream_are_counted_in_frame_periods() {
        for (gap, expected) in [(0, 0), (33, 0), (45, 0), (66, 1), (100, 2), (-500, 0)] {
            assert_eq!(
                missing_by_time(gap * 1_000_000, 1e9 / 30.0),
                expected,
                "{gap}"
            );
        }
    }
}
