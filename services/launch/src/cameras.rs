//! The footage of a deployment's cameras, inspected before any process is started.

mod advice;
mod live;
mod pictures;

use deployment::Timeline;
use deployment::capture::{Camera, Config, Rotate, Tag};
use footage::{PictureNumbers, Rotation, SourceSpec, Turn};
use serde::{Deserialize, Serialize};

pub(crate) use live::{footage, lead_nanos};
pub use live::{is_live, live_camera};
pub use pictures::{rotation, settled};

/// Metadata of a camera's footage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Footage {
    /// Width and height, in pixels.
    pub size: [u32; 2],
    /// Number of frames to use.
    pub n_frames: u64,
    /// Rate of the used frames, per second of the scene, if known.
    pub frame_rate_hz: Option<f64>,
    /// For cameras with clocks of their own: the frame of the footage that belongs to each frame of the run.
    pub timeline: Option<Timeline>,
}

/// Returns the footage of a camera, with the range of frames to use.
pub fn source(camera: &Camera, config: &Config) -> SourceSpec {
    SourceSpec {
        start: config.start_frame,
        step: config.frame_step,
        count: config.n_frames,
        frame_rate_hz: config.frame_rate_hz,
        rotation: match camera.rotate {
            None => Rotation::Stored,
            Some(Rotate::Tag(Tag::Tag)) => Rotation::Tag,
            Some(Rotate::Degrees(degrees)) => {
                Rotation::By(Turn::clockwise(degrees.into()).unwrap_or_default())
            }
        },
        numbers: camera.numbers.map(|[first, step]| PictureNumbers { first, step }),
        ..SourceSpec::new(camera.source.clone())
    }
}
