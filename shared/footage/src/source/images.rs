//! Image files as footage: a sequence, or one image repeated.

use std::path::{Path, PathBuf};

use super::decode::{Encoded, Turn};
use crate::{FootageError, Size, SourceSpec};

/// The images to be read, in order.
#[derive(Debug)]
pub(super) struct Images {
    paths: std::vec::IntoIter<PathBuf>,
    first: PathBuf,
    pub(super) size: Size,
    /// Orientation tag of the first image.
    pub(super) turn: Turn,
    pub(super) n_frames: u64,
}

impl Images {
    pub(super) fn open(paths: Vec<PathBuf>, spec: &SourceSpec) -> Result<Self, FootageError> {
        let n_frames = spec.n_delivered(paths.len() as u64)?;
        let step = usize::try_from(spec.step).unwrap_or(usize::MAX);
        let paths: Vec<PathBuf> = paths
            .into_iter()
            .skip(spec.start as usize)
            .step_by(step)
            .take(n_frames as usize)
            .collect();
        let first = paths.first().cloned().unwrap_or_default();
        let encoded = Encoded::read(&first)?;
        let (size, turn) = (encoded.size()?, encoded.turn());
        Ok(Self {
            paths: paths.into_iter(),
            size,
            turn,
            first,
            n_frames,
        })
    }

    pub(super) fn first(&self) -> &Path {
        &self.first
    }

    pub(super) fn read_into(&mut self, rgb: &mut [u8]) -> Result<bool, FootageError> {
        let Some(path) = self.paths.next() else {
            return Ok(false);
        };
        let encoded = Encoded::read(&path)?;
        let found = encoded.size()?;
        if found != self.size {
            return Err(FootageError::SizeDiffers {
                path,
                found,
                first: self.first.clone(),
                expected: self.size,
            });
        }
        encoded.decode_into(rgb)?;
        Ok(true)
    }

    /// Skips the next image without opening it.
    pub(super) fn skip_one(&mut self) -> bool {
        self.paths.next().is_some()
    }
}

/// One image, decoded once and repeated.
#[derive(Debug)]
pub(super) struct Still {
    rgb: Vec<u8>,
    pub(super) size: Size,
    pub(super) turn: Turn,
    pub(super) n_left: u64,
}

impl Still {
    pub(super) fn open(path: &Path, n_frames: u64) -> Result<Self, FootageError> {
        let encoded = Encoded::read(path)?;
        let size = encoded.size()?;
        let mut rgb = vec![0; size.rgb_bytes()];
        encoded.decode_into(&mut rgb)?;
        Ok(Self {
            rgb,
            size,
            turn: encoded.turn(),
            n_left: n_frames,
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

/// Decodes one image file: its size and its pixels, `width * height * 3` bytes of RGB, row major.
///
/// The same pixels as those of [`Source`](crate::Source); `path` is a file, never a pattern.
///
/// # Errors
///
/// [`FootageError`]: absent, empty, damaged or too large; each names the file.
pub fn read_image(path: &Path) -> Result<(Size, Vec<u8>), FootageError> {
    Still::open(path, 1).map(|still| (still.size, still.rgb))
}

/// Decodes one image file upright: [`read_image`] with its orientation tag (EXIF) applied. Returns the tag too.
///
/// For pictures without a calibration. A calibration refers to pixels as they are stored: use
/// [`read_image`] or [`Source`](crate::Source) with it.
///
/// # Errors
///
/// As [`read_image`].
pub fn read_upright(path: &Path) -> Result<(Size, Vec<u8>, Turn), FootageError> {
    let Still {
        rgb, size, turn, ..
    } = Still::open(path, 1)?;
    let (size, rgb) = turn.apply(size, rgb);
    Ok((size, rgb, turn))
}

/// Whether the content of a file is that of an image (an empty file of an image's name counts as one).
///
/// # Errors
///
/// [`FootageError`]: absent, unreadable or empty.
pub fn is_image(path: &Path) -> Result<bool, FootageError> {
    use std::io::Read as _;
    let mut head = Vec::with_capacity(32);
    std::fs::File::open(path)
        .and_then(|file| file.take(32).read_to_end(&mut head))
        .map_err(|source| FootageError::Io {
            path: path.to_path_buf(),
            source,
        })?;
    if head.is_empty() {
        return Err(FootageError::Empty {
            path: path.to_path_buf(),
        });
    }
    let by_content = image::guess_format(&head).is_ok_and(|format| format.reading_enabled());
    let by_name = image::ImageFormat::from_path(path).is_ok_and(|format| format.reading_enabled());
    Ok(by_content || by_name)
}
