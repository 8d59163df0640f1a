//! A live camera, whose pictures are assigned to the common instants of all cameras in a run.
//!
//! Reading order: [`LiveCamera`] (the camera to open), `input` (an open device or stream), `originals` (its
//! original pictures, for a recording), `source` (the thread that keeps
//! it open, and the newest pictures), `grid` (the instant that a picture belongs to), `phase` (how far
//! pictures are from their instants).

mod address;
mod clock;
mod grid;
mod input;
mod originals;
mod phase;
mod source;

pub use address::{LiveCamera, LiveError};
pub use input::take_picture;

pub(crate) use grid::Grid;
pub(crate) use originals::{Original, Originals};
pub(crate) use phase::Phase;
pub(crate) use source::{Picture, Source};

/// A live camera of a run.
#[derive(Debug, Clone)]
pub struct LiveJob {
    /// The camera.
    pub camera: LiveCamera,
    /// Size of the pictures, in pixels.
    pub size: footage::Size,
    /// Number of common instants per second, before `frame_step`.
    pub rate_hz: f64,
    /// True if the original pictures are recorded.
    pub is_kept: bool,
    /// Name of the camera.
    pub name: String,
    /// Largest distance of pictures from the instants without a warning, in nanoseconds.
    pub max_skew_nanos: u64,
    /// Time from the beginning of the run to the first instant, in nanoseconds. It is the same for all cameras of the run.
    pub lead_nanos: u64,
}
