//! What is known of a camera's pictures before the first one.

use footage::{Size, Turn};

/// The properties of a camera's pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedInfo {
    /// Size of every picture.
    pub size: Size,
    /// Number of frames.
    pub n_frames: u64,
    /// Frames per second of the scene, where it is known.
    pub frame_rate_hz: Option<f64>,
    /// The orientation tag of the first image. It is not applied: a calibration refers to the pixels as stored.
    pub turn: Turn,
}
