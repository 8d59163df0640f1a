//! A live camera: its pictures are brought to the instants that all cameras of a run have in common.
//!
//! Reading order: [`LiveCamera`] (what to open), `input` (a device or a stream that is open), `originals` (its
//! pictures as they came, for a recording), `source` (the thread that keeps
//! it open, and the newest pictures), `grid` (which instant a picture belongs to), `phase` (how far
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
    /// Size of its pictures, pixels.
    pub size: footage::Size,
    /// Common instants per second, before `frame_step`.
    pub rate_hz: f64,
    /// True if its pictures are recorded as they come.
    pub is_kept: bool,
    /// Its name.
    pub name: String,
    /// How far its pictures may be from the instants before a warning, nanoseconds.
    pub max_skew_nanos: u64,
    /// From the beginning of the run to the first instant, nanoseconds: every camera of the run has the same.
    pub lead_nanos: u64,
}
