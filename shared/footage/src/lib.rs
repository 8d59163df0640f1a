//! Reads image sequences and videos, warps images into a given buffer, draws overlays, writes videos, and paces
//! frames.
//!
//! Every image is 8-bit RGB, row major, `width * height * 3` bytes. A point is `[x, y]` in pixels, with the centre of the top-left pixel at
//! `(0, 0)`. This crate knows nothing about cameras or skeletons: it takes affine maps and points.
#![forbid(unsafe_code)]

mod error;
mod size;
mod source;
mod spec;
mod turn;

mod http;
mod pieces;
mod pixels;
mod programs;
mod remade;
mod sender;
mod stream;
mod warp;

mod pacer;

mod encode;

mod overlay;

pub use encode::VideoWriter;
pub use error::FootageError;
pub use overlay::{
    ACCENT, CENTRE, Canvas, Colour, FAINT, LEFT, Limb, OverlayError, RIGHT, Side, TEXT_HEIGHT,
    Tile, compose, draw_limbs, line_width, text_width,
};
pub use pacer::Pacer;
pub use pieces::{Piece, PieceKind, Pieces};
pub use pixels::PixelFormat;
pub use remade::RemadeStream;
pub use size::Size;
pub use source::{
    Complaints, Counting, Depth, FrameView, LiveAddress, RecordedSound, Source, SourceInfo,
    SourceKind, answers_so_far, is_address, is_image, is_live, picture_numbers, read_image,
    read_sound, read_upright, remember_answers, stored, without_passwords,
};
pub use spec::{PictureNumbers, SourceSpec};
pub use stream::{LiveStream, StreamEnd, StreamFrame, StreamSpec, Transport};
pub use turn::{Rotation, Turn};
pub use warp::{Affine, Fill, Warp, WarpError, resize_map, shrunk_map};
