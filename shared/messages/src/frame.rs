//! One image of one view.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{Stamp, Status, Timing};

/// Travels as the user header of the pixels: `[u8]`, RGB, row major, `width * height * 3` bytes.
///
/// The image is what the rest of the pipeline sees: already turned upright, resized and cropped.
/// The header's alignment makes the pixels begin on a cache line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("FrameHeader.v1")]
#[repr(C)]
#[repr(align(64))]
pub struct FrameHeader {
    /// Which frame.
    pub stamp: Stamp,
    /// When.
    pub timing: Timing,
    /// Width, pixels; 0 if there is no image.
    pub width: u32,
    /// Height, pixels; 0 if there is no image.
    pub height: u32,
    /// Whether there is an image.
    pub status: Status,
    /// Keeps the layout free of padding.
    pub reserved: u32,
    /// Frames of this view that were due but never sent, since the session began.
    pub n_dropped: u64,
    /// Keeps the layout free of padding.
    pub reserved_end: [u64; 7],
}
