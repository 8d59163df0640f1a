//! Errors of footage.

use std::path::{Path, PathBuf};

use crate::Size;

/// Why footage cannot be opened or read. Names the file, and the numbers needed to act.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FootageError {
    /// There is no file, folder or match of that name.
    #[error("no such footage: {path}{}", what_is_missing(path))]
    NotFound {
        /// As the user wrote it.
        path: String,
    },
    /// A camera, a stream or a device.
    #[error("{path} is {what}, not footage: {instead}")]
    Live {
        /// As the user wrote it.
        path: String,
        /// Kind of source.
        what: &'static str,
        /// Remedy: the input to use instead.
        instead: String,
    },
    /// The name is empty.
    #[error("the footage has no name: it is \"\"")]
    NoName,
    /// A name that is not UTF-8, so that it was changed by conversion.
    #[error(
        "no such footage: {path}; its name, or that of a folder above it, is not UTF-8 (the odd bytes are shown as \
         \u{fffd}): rename it"
    )]
    NotUtf8 {
        /// With the invalid bytes replaced.
        path: String,
    },
    /// A glob that cannot be parsed.
    #[error("cannot understand the pattern {pattern}")]
    BadPattern {
        /// As the user wrote it.
        pattern: String,
        /// Where and why.
        source: glob::PatternError,
    },
    /// A folder or pattern without any image.
    #[error("no image (png, jpg, jpeg, bmp) in {path}")]
    NoImages {
        /// As the user wrote it.
        path: String,
    },
    /// The operating system reports an error.
    #[error("cannot read {}", path.display())]
    Io {
        /// Path that could not be read.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file of 0 bytes.
    #[error("{} is empty (0 bytes)", path.display())]
    Empty {
        /// Which.
        path: PathBuf,
    },
    /// Not an image, damaged, or cut off.
    #[error("cannot decode the image {}", path.display())]
    Image {
        /// Which.
        path: PathBuf,
        /// Why.
        source: image::ImageError,
    },
    /// The images of one sequence must be of one size.
    #[error("{} is {found}, but the sequence began with {expected} ({})", path.display(), first.display())]
    SizeDiffers {
        /// The image that differs.
        path: PathBuf,
        /// Its size.
        found: Size,
        /// The first image.
        first: PathBuf,
        /// The size of the first image.
        expected: Size,
    },
    /// A live stream cannot be opened, or has ended.
    #[error("no pictures from {address}: {message}")]
    Stream {
        /// Which, without a password.
        address: String,
        /// Message of the decoder.
        message: String,
    },
    /// A live stream has pictures of another size now.
    #[error("{} no longer has pictures of {expected}", path.display())]
    SizeChanged {
        /// Which.
        path: PathBuf,
        /// The size that it had.
        expected: Size,
    },
    /// Too small to detect a person.
    #[error("{} is {size}: width and height must be at least {min_side} pixels", path.display())]
    TooSmall {
        /// Which.
        path: PathBuf,
        /// Its size.
        size: Size,
        /// The smallest side accepted.
        min_side: usize,
    },
    /// `step` is 0.
    #[error("frame step must be at least 1, got 0")]
    ZeroStep,
    /// `count` is 0.
    #[error("number of frames must be at least 1, got 0")]
    ZeroCount,
    /// `frame_rate_hz` is not a positive number.
    #[error("frame rate must be a positive number of hertz, got {rate_hz}")]
    BadRate {
        /// As given.
        rate_hz: f64,
    },
    /// `start` lies beyond the last frame.
    #[error("first frame {start} lies beyond the {n_frames} frames (counted from 0) of {path}")]
    StartBeyondEnd {
        /// As the user wrote it.
        path: String,
        /// First frame asked for, from 0.
        start: u64,
        /// Number of frames.
        n_frames: u64,
    },
    /// The executable that decodes videos is absent.
    #[error(
        "cannot run {}, which is needed to read the video {}: install ffmpeg (`apt-get install ffmpeg`, \
         `brew install ffmpeg`, or https://ffmpeg.org/download.html) and put it on the PATH",
        executable.display(), path.display()
    )]
    FfmpegMissing {
        /// Executable that was looked for.
        executable: PathBuf,
        /// The video that needs it.
        path: PathBuf,
        /// Why it did not start.
        source: std::io::Error,
    },
    /// A video cannot be written.
    #[error("cannot write the video {}: {message}", path.display())]
    Encode {
        /// Which.
        path: PathBuf,
        /// Message of the encoder.
        message: String,
    },
    /// Not a video, or damaged.
    #[error("cannot decode the video {}: {message}", path.display())]
    Video {
        /// Which.
        path: PathBuf,
        /// Message of the decoder.
        message: String,
    },
    /// The video ends before its last frame.
    #[error("the video {} is cut off or damaged: {n_read} frames of {n_expected} could be read: {message}", path.display())]
    VideoTruncated {
        /// Which.
        path: PathBuf,
        /// Frames that could be read.
        n_read: u64,
        /// Number of frames according to its header or index.
        n_expected: u64,
        /// Message of the decoder.
        message: String,
    },
}

/// A hint for the message: the folder that is missing, or what the source of a webcam is called.
fn what_is_missing(path: &str) -> String {
    let path = Path::new(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_digit()) {
        return "; if that is the number of a webcam, its source is /dev/video".to_owned() + &name;
    }
    let absent = path
        .ancestors()
        .skip(1)
        .take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists());
    absent.last().map_or_else(String::new, |folder| {
        format!("; there is no folder {}", folder.display())
    })
}
