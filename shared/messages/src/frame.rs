//! One image of one view.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{Stamp, Status, Timing};

/// The user header of a sample of pixels: `[u8]`, RGB, row major, `width * height * 3` bytes.
///
/// All later stages process this image, which has already been rotated upright, resized and cropped. The header's alignment places the
/// pixels at the start of a cache line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("FrameHeader.v1")]
#[repr(C)]
#[repr(align(64))]
pub struct FrameHeader {
    /// Identity of the frame.
    pub stamp: Stamp,
    /// Times at which the input arrived and the message was sent.
    pub timing: Timing,
    /// Width, in pixels; 0 if there is no image.
    pub width: u32,
    /// Height, in pixels; 0 if there is no image.
    pub height: u32,
    /// States whether there is an image and, if not, why.
    pub status: Status,
    /// Explicit padding.
    pub reserved: u32,
    /// Number of frames of this view since the session began that were due but never sent.
    pub n_dropped: u64,
    /// Time from the common instant of the frame, which is the same for all views, until the picture was taken, in nanoseconds. Negative if
    /// the picture was taken earlier; 0 if the time is not known.
    pub skew_nanos: i64,
    /// Explicit padding.
    pub reserved_end: [u64; 6],
}
