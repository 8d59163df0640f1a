//! Pictures in and pictures out: image sequences and videos, warps into a given buffer, overlays, pacing.
//!
//! Every image is 8-bit RGB, row major, `width * height * 3` bytes. A point is `[x, y]` in pixels with
//! the centre of the top-left pixel at `(0, 0)`. This crate knows no camera and no body: whoever does
//! gives it affine maps and plain points.
#![forbid(unsafe_code)]

mod error;
mod pacer;
mod size;
mod source;
mod spec;
mod warp;

mod overlay;

pub use error::FootageError;
pub use overlay::{
    CENTRE, Canvas, Colour, LEFT, Limb, OverlayError, RIGHT, Side, Tile, compose, draw_limbs,
};
pub use pacer::Pacer;
pub use size::Size;
pub use source::{FrameView, Source, SourceInfo, SourceKind};
pub use spec::SourceSpec;
pub use warp::{Affine, Fill, Warp, WarpError, resize_map};
