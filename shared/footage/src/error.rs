//! Errors of footage.

use std::path::{Path, PathBuf};

use crate::Size;

/// Reason why footage cannot be opened or read. It names the file and the numbers that help to fix the problem.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FootageError {
    /// No file or folder has this name, and nothing matches it as a pattern.
    #[error("no such footage: {path}{}", what_is_missing(path))]
    NotFound {
        /// Path as the user wrote it.
        path: String,
    },
    /// The path is the address of a camera, a stream or a device.
    #[error("{path} is {what}, but footage is expected: {instead}")]
    Live {
        /// Path as the user wrote it.
        path: String,
        /// Kind of source.
        what: &'static str,
        /// Advice for the user: the input to use instead.
        instead: String,
    },
    /// The name of the footage is empty.
    #[error("the footage has no name: it is \"\"")]
    NoName,
    /// The name is not UTF-8, and the conversion changed it.
    #[error(
        "no such footage: {path}; its name, or that of a folder above it, is not UTF-8 (invalid bytes are shown as \
         \u{fffd}): rename it"
    )]
    NotUtf8 {
        /// Path in which the invalid bytes are replaced.
        path: String,
    },
    /// The glob cannot be parsed.
    #[error("cannot understand the pattern {pattern}")]
    BadPattern {
        /// Pattern as the user wrote it.
        pattern: String,
        /// Position and cause of the error.
        source: glob::PatternError,
    },
    /// The folder contains no image, or no image matches the pattern.
    #[error("no image (png, jpg, jpeg, bmp) in {path}")]
    NoImages {
        /// Path as the user wrote it.
        path: String,
    },
    /// The operating system reports an error.
    #[error("cannot read {}", path.display())]
    Io {
        /// Path that could not be read.
        path: PathBuf,
        /// Cause of the error.
        source: std::io::Error,
    },
    /// The file has 0 bytes.
    #[error("{} is empty (0 bytes)", path.display())]
    Empty {
        /// Path of the file.
        path: PathBuf,
    },
    /// The file is not an image, or is damaged or truncated.
    #[error("cannot decode the image {}", path.display())]
    Image {
        /// Path of the file.
        path: PathBuf,
        /// Cause of the error.
        source: image::ImageError,
    },
    /// The images of a sequence do not have the same size.
    #[error("{} is {found}, but the sequence began with {expected} ({})", path.display(), first.display())]
    SizeDiffers {
        /// Path of the image that differs.
        path: PathBuf,
        /// Size of the image that differs.
        found: Size,
        /// Path of the first image.
        first: PathBuf,
        /// Size of the first image.
        expected: Size,
    },
    /// A live stream cannot be opened, or has ended.
    #[error("no pictures were received from {address}: {message}")]
    Stream {
        /// Address of the stream, without a password.
        address: String,
        /// Message of the decoder.
        message: String,
    },
    /// The pictures of a live stream have changed their size.
    #[error("{} no longer has pictures of {expected}", path.display())]
    SizeChanged {
        /// Path of the stream.
        path: PathBuf,
        /// Size of the first pictures.
        expected: Size,
    },
    /// The pictures are too small to detect a person.
    #[error("{} is {size}: width and height must be at least {min_side} pixels", path.display())]
    TooSmall {
        /// Path of the footage.
        path: PathBuf,
        /// Size of the pictures.
        size: Size,
        /// Minimum width and height, in pixels.
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
        /// Value that was given.
        rate_hz: f64,
    },
    /// `start` is after the last frame.
    #[error("first frame {start} is beyond the {n_frames} frames (counted from 0) of {path}")]
    StartBeyondEnd {
        /// Path as the user wrote it.
        path: String,
        /// Requested first frame, counted from 0.
        start: u64,
        /// Number of frames.
        n_frames: u64,
    },
    /// The executable that decodes videos is missing.
    #[error(
        "cannot run {}, which is needed to read the video {}: install ffmpeg (`apt-get install ffmpeg`, \
         `brew install ffmpeg`, or https://ffmpeg.org/download.html) and put it on the PATH",
        executable.display(), path.display()
    )]
    FfmpegMissing {
        /// Executable that was not found.
        executable: PathBuf,
        /// Video that needs the executable.
        path: PathBuf,
        /// Reason why the executable did not start.
        source: std::io::Error,
    },
    /// A video cannot be written.
    #[error("cannot write the video {}: {message}", path.display())]
    Encode {
        /// Path of the video.
        path: PathBuf,
        /// Message of the encoder.
        message: String,
    },
    /// The file is not a video, or is damaged.
    #[error("cannot decode the video {}: {message}", path.display())]
    Video {
        /// Path of the video.
        path: PathBuf,
        /// Message of the decoder.
        message: String,
    },
    /// The video ends before its last frame.
    #[error("the video {} is cut off or damaged: {n_read} frames of {n_expected} could be read: {message}", path.display())]
    VideoTruncated {
        /// Path of the video.
        path: PathBuf,
        /// Number of frames that could be read.
        n_read: u64,
        /// Number of frames according to the header or index.
        n_expected: u64,
        /// Message of the decoder.
        message: String,
    },
}

/// Returns a hint for the message: which folder is missing, or how to write the name of a webcam.
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
