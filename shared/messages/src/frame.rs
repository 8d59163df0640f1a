//! One image of one view.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{Stamp, Status, Timing};

/// The user header of a sample of pixels: `[u8]`, RGB, row major, `width * height * 3` bytes.
///
/// The image is the one that all later stages process: turned upright, resized and cropped. The
/// header's alignment places the pixels at the start of a cache line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("FrameHeader.v1")]
#[repr(C)]
#[repr(align(64))]
pub struct FrameHeader {
    /// The frame.
    pub stamp: Stamp,
    /// When it was received and sent.
    pub timing: Timing,
    /// Width, pixels; 0 if there is no image.
    pub width: u32,
    /// Height, pixels; 0 if there is no image.
    pub height: u32,
    /// Says that there is an image, or why there is none.
    pub status: Status,
    /// Explicit padding.
    pub reserved: u32,
    /// Number of frames of this view that were due but never sent, since the session began.
    pub n_dropped: u64,
    /// How long after the instant of the frame, which all views have in common, the picture was taken, nanoseconds;
    /// negative for before, 0 if it is not known.
    pub skew_nanos: i64,
    /// Explicit padding.
    pub reserved_end: [u64; 6],
}
