//! Properties of a camera's pictures that are known before the first picture.

use footage::{Depth, Size, Turn};

/// The properties of a camera's pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedInfo {
    /// Size of every picture as delivered.
    pub size: Size,
    /// Factor by which the pictures were shrunk ([`footage::SourceSpec::most_shrink`]).
    pub shrink: usize,
    /// Number of frames.
    pub n_frames: u64,
    /// Frames per second of the scene, if known.
    pub frame_rate_hz: Option<f64>,
    /// Rotation that the tag of the first image or of the video asks for, whether or not it is applied.
    pub tag: Turn,
    /// Number of bits that 16-bit images use, if fewer than 16.
    pub depth: Option<Depth>,
    /// True if the pictures are interlaced: every picture consists of two pictures from different moments, line by line.
    pub is_interlaced: bool,
    /// Largest difference of a picture's time from equally spaced times, in seconds, if a video is not evenly spaced.
    pub uneven_s: Option<f64>,
}

impl FeedInfo {
    /// Returns the properties of generated pictures.
    pub(crate) fn plain(size: Size, n_frames: u64, frame_rate_hz: f64) -> Self {
        Self {
            size,
            shrink: 1,
            n_frames,
            frame_rate_hz: Some(frame_rate_hz),
            tag: Turn::default(),
            depth: None,
            is_interlaced: false,
            uneven_s: None,
        }
    }
}
