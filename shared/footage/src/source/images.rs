//! Image files as footage: a sequence, or one image repeated.

use std::path::{Path, PathBuf};

use super::decode::{Depth, Encoded, Reading, is_jpeg_stream};
use super::numbers::Numbered;
use crate::turn::{Rotation, Turn};
use crate::{FootageError, Size, SourceSpec};

/// Number of bytes of a file that are searched for a second picture.
const MAX_PICTURE: u64 = 64 << 20;
/// Maximum number of images of a sequence that are read to find out how many bits are used.
const N_BRIGHTEST: usize = 8;

/// The images to read, in order.
#[derive(Debug)]
pub(super) struct Images {
    /// Images that have not been read yet.
    files: std::vec::IntoIter<Numbered>,
    first: PathBuf,
    reading: Reading,
    /// Size of all images after rotation.
    pub(super) size: Size,
    /// Orientation tag of the first image.
    pub(super) tag: Turn,
    /// Number of frames, including those without an image.
    pub(super) n_frames: u64,
    /// Index after the last frame.
    end: u64,
}

impl Images {
    /// Opens a sequence.
    ///
    /// * `files`: all images, with the numbers of their frames.
    pub(super) fn open(files: Vec<Numbered>, spec: &SourceSpec) -> Result<Self, FootageError> {
        let n_all = files.last().map_or(0, |file| file.frame + 1);
        let n_frames = spec.n_delivered(n_all)?;
        let end = spec.start.saturating_add(n_frames.saturating_mul(spec.step));
        let depth = depth(&files)?;
        let is_used = |frame: u64| {
            let is_within = (spec.start..end).contains(&frame);
            is_within && (frame - spec.start).is_multiple_of(spec.step)
        };
        let any = files.first().map(|file| file.path.clone()).unwrap_or_default();
        let files: Vec<Numbered> = files.into_iter().filter(|file| is_used(file.frame)).collect();
        let first = files.first().map_or(any, |file| file.path.clone());
        let encoded = Encoded::read(&first)?;
        let rotation = spec.rotation;
        Ok(Self {
            files: files.into_iter(),
            size: encoded.turned_size(rotation)?,
            tag: encoded.tag(),
            first,
            reading: Reading { rotation, depth },
            n_frames,
            end,
        })
    }

    pub(super) fn first(&self) -> &Path {
        &self.first
    }

    pub(super) fn depth(&self) -> Option<Depth> {
        self.reading.depth
    }

    /// Reads the next image. Returns the number of its frame; `None` at the end.
    pub(super) fn read_into(&mut self, rgb: &mut [u8]) -> Result<Option<u64>, FootageError> {
        let Some(Numbered { path, frame }) = self.files.next() else {
            return Ok(None);
        };
        let encoded = Encoded::read(&path)?;
        let found = encoded.turned_size(self.reading.rotation)?;
        if found != self.size {
            return Err(FootageError::SizeDiffers {
                path,
                found,
                first: self.first.clone(),
                expected: self.size,
            });
        }
        rgb.copy_from_slice(&encoded.decode(self.reading)?.1);
        Ok(Some(frame))
    }

    /// Skips a frame without opening its image. Returns true if there was such a frame.
    pub(super) fn skip_one(&mut self, frame: u64) -> bool {
        if self.files.as_slice().first().is_some_and(|file| file.frame <= frame) {
            self.files.next();
        }
        frame < self.end
    }
}

/// Returns the number of bits that the images use, estimated from some images of the whole sequence. Returns `None` if the images have 8
/// bits, or if they use all 16 bits.
fn depth(files: &[Numbered]) -> Result<Option<Depth>, FootageError> {
    let mut brightest = None;
    for it in files.iter().step_by(files.len().div_ceil(N_BRIGHTEST).max(1)) {
        let Some(value) = Encoded::read(&it.path)?.brightest()? else {
            return Ok(None);
        };
        brightest = brightest.max(Some(value));
        if Depth::of(value).is_none() && value > 0 {
            return Ok(None);
        }
    }
    Ok(brightest.and_then(Depth::of))
}

/// Returns the size of an image as it is stored, and the rotation in its tag.
pub(super) fn stored(path: &Path) -> Result<(Size, Turn), FootageError> {
    let encoded = Encoded::read(path)?;
    Ok((encoded.size()?, encoded.tag()))
}

/// One image, decoded once and repeated.
#[derive(Debug)]
pub(super) struct Still {
    rgb: Vec<u8>,
    pub(super) size: Size,
    pub(super) tag: Turn,
    pub(super) n_left: u64,
    pub(super) depth: Option<Depth>,
}

impl Still {
    pub(super) fn open(
        path: &Path,
        n_frames: u64,
        rotation: Rotation,
    ) -> Result<Self, FootageError> {
        let encoded = Encoded::read(path)?;
        let depth = encoded.brightest()?.and_then(Depth::of);
        let (size, rgb) = encoded.decode(Reading { rotation, depth })?;
        Ok(Self {
            rgb,
            size,
            tag: encoded.tag(),
            n_left: n_frames,
            depth,
        })
    }

    pub(super) fn read_into(&mut self, rgb: &mut [u8]) -> bool {
        let is_there = self.skip_one();
        if is_there {
            rgb.copy_from_slice(&self.rgb);
        }
        is_there
    }

    pub(super) fn skip_one(&mut self) -> bool {
        let is_there = self.n_left > 0;
        self.n_left -= u64::from(is_there);
        is_there
    }
}

/// Decodes one image file. Returns its size and its pixels, `width * height * 3` bytes of RGB, row major.
///
/// The pixels are the same as those of [`Source`](crate::Source). `path` is a file, never a pattern.
///
/// # Errors
///
/// Returns a [`FootageError`] if the file is missing, empty, damaged or too large. The error names the file.
pub fn read_image(path: &Path) -> Result<(Size, Vec<u8>), FootageError> {
    Still::open(path, 1, Rotation::Stored).map(|still| (still.size, still.rgb))
}

/// Decodes one image file upright, with its orientation tag (EXIF) applied. Otherwise it works like [`read_image`], and also returns
/// the tag.
///
/// Use this for pictures without a calibration. A calibration refers to pixels as they are stored: use
/// [`read_image`] or [`Source`](crate::Source) with it.
///
/// # Errors
///
/// Fails in the same cases as [`read_image`].
pub fn read_upright(path: &Path) -> Result<(Size, Vec<u8>, Turn), FootageError> {
    let still = Still::open(path, 1, Rotation::Tag)?;
    Ok((still.size, still.rgb, still.tag))
}

/// Returns true if the content of a file is one image. A sequence of JPEG pictures in one file is a video. An empty file counts as an image
/// if its name is that of an image.
///
/// # Errors
///
/// Returns a [`FootageError`] if the file is missing, unreadable or empty.
pub fn is_image(path: &Path) -> Result<bool, FootageError> {
    use std::io::Read as _;
    let failed = |source| FootageError::Io {
        path: path.to_path_buf(),
        source,
    };
    let mut file = std::fs::File::open(path).map_err(failed)?;
    let mut head = Vec::with_capacity(32);
    (&mut file).take(32).read_to_end(&mut head).map_err(failed)?;
    if head.is_empty() {
        return Err(FootageError::Empty {
            path: path.to_path_buf(),
        });
    }
    let format = image::guess_format(&head).ok();
    if format == Some(image::ImageFormat::Jpeg) {
        file.take(MAX_PICTURE).read_to_end(&mut head).map_err(failed)?;
        return Ok(!is_jpeg_stream(&head));
    }
    let by_content = format.is_some_and(|format| format.reading_enabled());
    let by_name = image::ImageFormat::from_path(path).is_ok_and(|format| format.reading_enabled());
    Ok(by_content || by_name)
}
