//! A live camera. Its pictures are assigned to instants: the nominal frame times, which all cameras of a run share.
//!
//! Reading order: [`LiveCamera`] (the camera to open), `input` (an open device or stream), `originals` (its original pictures, for a
//! recording), `source` (the thread that keeps it open, and the newest pictures), `grid` (the instant that a picture belongs to), `phase`
//! (how much the times of pictures differ from their instants).

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
    /// Number of frames per second, before `frame_step` is applied.
    pub rate_hz: f64,
    /// True if the original pictures are recorded.
    pub is_kept: bool,
    /// Name of the camera.
    pub name: String,
    /// Largest difference between the times of pictures and the nominal times of their frames that causes no warning, in nanoseconds.
    pub max_skew_nanos: u64,
    /// Time from the beginning of the run to the nominal time of the first frame, in nanoseconds. It is the same for all cameras.
    pub lead_nanos: u64,
}
