//! Reads footage frame by frame.

mod answers;
mod decode;
mod exif;
mod images;
mod listing;
mod live;
pub(crate) mod log;
mod numbers;
pub(crate) mod password;
mod planes;
pub(crate) mod probe;
pub(crate) mod program;
mod sound;
mod video;

use std::path::Path;

pub use answers::{answers_so_far, remember_answers};
pub use decode::Depth;
pub(crate) use decode::{jpeg_into, jpeg_is_whole};
use images::{Images, Still};
pub use images::{is_image, read_image, read_upright};
use listing::Listing;
pub use live::{LiveAddress, is_address, is_live};
pub use log::Complaints;
pub use numbers::{Counting, picture_numbers};
pub use password::without_passwords;
pub use sound::{RecordedSound, read_sound};
use video::Video;

use crate::{FootageError, Size, SourceSpec, Turn};

/// Kind of footage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SourceKind {
    /// One image, repeated.
    Still,
    /// Images from a folder, a glob or a numbered pattern.
    Images,
    /// A video.
    Video,
}

/// Properties of footage that are known before its first frame is read.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceInfo {
    /// Size of every returned frame.
    pub size: Size,
    /// Factor by which the frames were shrunk ([`SourceSpec::most_shrink`]).
    pub shrink: usize,
    /// Number of frames to be read. A damaged video may have fewer frames; reading then ends with an error.
    pub n_frames: u64,
    /// Number of frames read per second of the scene (the footage's rate divided by `step`), if known.
    pub frame_rate_hz: Option<f64>,
    /// Kind of footage.
    pub kind: SourceKind,
    /// Rotation given by the tag of the first image or of the video, even if it is not applied; see [`Rotation`](crate::Rotation).
    pub tag: Turn,
    /// Number of bits that 16-bit images use, if it is less than 16. Their values are scaled accordingly.
    pub depth: Option<Depth>,
    /// True if a video is interlaced: the lines of every picture alternate between two different moments.
    pub is_interlaced: bool,
    /// Largest difference of a frame's time from equally spaced times, in seconds, if a video is not evenly spaced.
    pub uneven_s: Option<f64>,
}

/// One frame of footage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameView<'a> {
    /// Index in the footage, counted from 0: `start + k * step`. Some frames may be missing.
    pub index: u64,
    /// Presentation time, in seconds after frame 0 of the footage; `None` if the rate is not known.
    pub time_s: Option<f64>,
    /// The pixels, RGB, row major, `width * height * 3` bytes.
    pub rgb: &'a [u8],
}

/// Open footage, read frame by frame in order.
///
/// A frame of a video that cannot be decoded is left out. If frames are equally spaced, the gap is visible in the index of the next frame.
///
/// All frames have one size, and are 8-bit RGB regardless of the file's format. Grey values are copied to all three channels, an alpha
/// channel is dropped, and 16 bits are rounded to 8 (and scaled if the pictures use fewer than 16). Orientation tags (EXIF, or the display
/// matrix of a phone's video) are applied according to [`SourceSpec::rotation`].
///
/// ```no_run
/// use footage::{Source, SourceSpec};
///
/// let mut source = Source::open(&SourceSpec::new("cam01.mp4"))?;
/// println!("{} frames of {}", source.info().n_frames, source.info().size);
/// while let Some(frame) = source.next_frame()? {
///     println!("frame {} begins with {:?}", frame.index, &frame.rgb[..3]);
/// }
/// # Ok::<(), footage::FootageError>(())
/// ```
#[derive(Debug)]
pub struct Source {
    info: SourceInfo,
    clock: Clock,
    reader: Reader,
    /// True if the end was reached or reading has failed.
    is_over: bool,
    buffer: Vec<u8>,
}

#[derive(Debug)]
enum Reader {
    Still(Still),
    Images(Images),
    Video(Box<Video>),
}

impl Source {
    /// Opens footage. For a video, this starts the decoder.
    ///
    /// # Errors
    ///
    /// Returns every [`FootageError`] except [`SizeDiffers`](FootageError::SizeDiffers) and
    /// [`VideoTruncated`](FootageError::VideoTruncated), which can occur only while reading.
    pub fn open(spec: &SourceSpec) -> Result<Self, FootageError> {
        spec.check()?;
        let (path, reader) = match listing::list(&spec.path)? {
            Listing::Images(paths) => {
                let images = Images::open(numbers::frames(paths, spec.numbers), spec)?;
                (images.first().to_path_buf(), Reader::Images(images))
            }
            Listing::File(path) if is_image(&path)? => {
                let still = Still::open(&path, spec.count.unwrap_or(1), spec.rotation)?;
                (path, Reader::Still(still))
            }
            Listing::File(path) => {
                let video = Box::new(Video::open(&path, spec)?);
                (path, Reader::Video(video))
            }
        };
        let clock = Clock::new(&reader, spec);
        let info = reader.info(clock.rate_hz.map(|rate_hz| rate_hz / spec.step as f64));
        let Size { width, height } = info.size;
        let as_stored = Size::new(width * info.shrink, height * info.shrink);
        check_min_side(&path, as_stored, spec.min_side)?;
        Ok(Self {
            info,
            clock,
            reader,
            is_over: false,
            buffer: Vec::new(),
        })
    }

    /// Returns the properties that are known before the first frame is read.
    pub fn info(&self) -> &SourceInfo {
        &self.info
    }

    /// Returns the next frame, in a buffer of the source; `None` at the end and after it.
    ///
    /// # Errors
    ///
    /// Returns a [`FootageError`], which names the file. After an error, there are no more frames.
    pub fn next_frame(&mut self) -> Result<Option<FrameView<'_>>, FootageError> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.resize(self.info.size.rgb_bytes(), 0);
        let read = self.read_into(&mut buffer);
        self.buffer = buffer;
        Ok(read?.map(|(index, time_s)| FrameView {
            index,
            time_s,
            rgb: &self.buffer,
        }))
    }

    /// Returns the pixels of the last frame of [`next_frame`](Self::next_frame). They are undefined before the first frame, and
    /// after frames of a video were skipped.
    pub fn pixels(&self) -> &[u8] {
        &self.buffer
    }

    /// Decodes the next frame into `rgb`; returns `None` at the end and after it.
    ///
    /// * `rgb`: `width * height * 3` bytes, all of which are written. They are undefined after `None` or an error.
    ///
    /// # Errors
    ///
    /// Fails in the same cases as [`next_frame`](Self::next_frame).
    ///
    /// # Panics
    ///
    /// Panics if `rgb` has another length.
    pub fn next_into<'a>(
        &mut self,
        rgb: &'a mut [u8],
    ) -> Result<Option<FrameView<'a>>, FootageError> {
        let size = self.info.size;
        assert_eq!(rgb.len(), size.rgb_bytes(), "a frame is {size} in RGB");
        let read = self.read_into(rgb)?;
        Ok(read.map(|(index, time_s)| FrameView { index, time_s, rgb }))
    }

    /// Returns the error messages of a video's decoder so far; there are none for images.
    pub fn complaints(&self) -> Complaints {
        match &self.reader {
            Reader::Video(video) => video.complaints(),
            Reader::Images(_) | Reader::Still(_) => Complaints::default(),
        }
    }

    /// Skips the next `n` frames, and returns how many there were.
    ///
    /// Images are not opened, and frames without an image count as well. The frames of a video still have to be decoded.
    ///
    /// # Errors
    ///
    /// Fails in the same cases as [`next_frame`](Self::next_frame).
    pub fn skip(&mut self, n: u64) -> Result<u64, FootageError> {
        for n_skipped in 0..n {
            let is_there = match &mut self.reader {
                Reader::Video(_) => self.next_frame()?.is_some(),
                Reader::Images(images) if !self.is_over => {
                    let is_there = images.skip_one(self.clock.index);
                    self.clock.tick(is_there)
                }
                Reader::Still(still) if !self.is_over => self.clock.tick(still.skip_one()),
                Reader::Images(_) | Reader::Still(_) => false,
            };
            if !is_there {
                self.is_over = true;
                return Ok(n_skipped);
            }
        }
        Ok(n)
    }

    fn read_into(&mut self, rgb: &mut [u8]) -> Result<Option<(u64, Option<f64>)>, FootageError> {
        if self.is_over {
            return Ok(None);
        }
        // After an error, there are no more frames.
        self.is_over = true;
        let is_there = match &mut self.reader {
            Reader::Images(images) => self.clock.set(images.read_into(rgb)?),
            Reader::Video(video) => self.clock.set(video.read_into(rgb)?),
            Reader::Still(still) => still.read_into(rgb),
        };
        self.is_over = !is_there;
        let stamp = self.clock.stamp();
        Ok(self.clock.tick(is_there).then_some(stamp))
    }
}

impl Reader {
    fn info(&self, frame_rate_hz: Option<f64>) -> SourceInfo {
        let (kind, size, n_frames) = match self {
            Self::Still(still) => (SourceKind::Still, still.size, still.n_left),
            Self::Images(images) => (SourceKind::Images, images.size, images.n_frames),
            Self::Video(video) => (SourceKind::Video, video.size, video.n_frames),
        };
        SourceInfo {
            size,
            shrink: match self {
                Self::Video(video) => video.shrink,
                Self::Still(_) | Self::Images(_) => 1,
            },
            n_frames,
            frame_rate_hz,
            kind,
            tag: match self {
                Self::Still(still) => still.tag,
                Self::Images(images) => images.tag,
                Self::Video(video) => video.probe.tag,
            },
            depth: match self {
                Self::Still(still) => still.depth,
                Self::Images(images) => images.depth(),
                Self::Video(_) => None,
            },
            is_interlaced: matches!(self, Self::Video(video) if video.probe.is_interlaced),
            uneven_s: match self {
                Self::Still(_) | Self::Images(_) => None,
                Self::Video(video) => video.probe.uneven_s,
            },
        }
    }
}

/// Returns the size of the footage's pictures as they are stored, and the rotation in the tag of the first picture. This is faster than
/// opening the footage.
///
/// # Errors
///
/// Fails in the same cases as [`Source::open`].
pub fn stored(spec: &SourceSpec) -> Result<(Size, Turn), FootageError> {
    let image = match listing::list(&spec.path)? {
        Listing::Images(paths) => paths.into_iter().next().unwrap_or_default(),
        Listing::File(path) if is_image(&path)? => path,
        Listing::File(path) => return probe::stored(&path, spec),
    };
    images::stored(&image)
}

/// Index and time of the next frame.
#[derive(Debug)]
struct Clock {
    index: u64,
    step: u64,
    /// Frame rate of the footage, before `step` is applied.
    rate_hz: Option<f64>,
    /// Times of the frames, if they are not equally spaced.
    times_s: Option<Vec<f64>>,
}

impl Clock {
    fn new(reader: &Reader, spec: &SourceSpec) -> Self {
        let (own_hz, times_s) = match reader {
            Reader::Video(video) => (video.probe.rate_hz, video.probe.times_s.clone()),
            Reader::Still(_) | Reader::Images(_) => (None, None),
        };
        Self {
            index: spec.start,
            step: spec.step,
            rate_hz: own_hz.or(spec.frame_rate_hz),
            times_s,
        }
    }

    fn stamp(&self) -> (u64, Option<f64>) {
        let by_rate = || self.rate_hz.map(|rate_hz| self.index as f64 / rate_hz);
        let listed = self.times_s.as_ref().and_then(|times_s| times_s.get(self.index as usize));
        (self.index, listed.copied().or_else(by_rate))
    }

    /// Sets the index to that of the frame that was read, if a frame was read.
    fn set(&mut self, index: Option<u64>) -> bool {
        self.index = index.unwrap_or(self.index);
        index.is_some()
    }

    /// Advances by one frame if `was_there` is true, and returns `was_there`.
    fn tick(&mut self, was_there: bool) -> bool {
        if was_there {
            self.index = self.index.saturating_add(self.step);
        }
        was_there
    }
}

fn check_min_side(path: &Path, size: Size, min_side: usize) -> Result<(), FootageError> {
    if size.width.min(size.height) < min_side {
        return Err(FootageError::TooSmall {
            path: path.to_path_buf(),
            size,
            min_side,
        });
    }
    Ok(())
}
