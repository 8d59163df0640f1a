//! One picture of a live camera, as the camera sent it.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_NAME, Stamp, Status, Timing};

/// Value of the picture's number if the camera does not number its pictures.
pub const NO_SEQUENCE: u64 = u64::MAX;

/// The user header of a picture of a live camera in its original form, for recordings.
///
/// The payload is `[u8]`: a JPEG file, raw pixels, or a piece of a Matroska stream. `frame` of the stamp is the number of the
/// picture, counted from 0 at every start of the process. Each picture that was not sent leaves a gap in the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PictureHeader.v1")]
#[repr(C)]
#[repr(align(64))]
pub struct PictureHeader {
    /// Number of the picture, and the time at which it was taken.
    pub stamp: Stamp,
    /// Times at which the picture arrived and the message was sent.
    pub timing: Timing,
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
    /// States whether there is a picture and, if not, why: [`Status::OK`], [`Status::DAMAGED`] or [`Status::END`].
    pub status: Status,
    /// Format of the bytes, four letters.
    ///
    /// Pictures have the names of Linux (`MJPG`, `YUYV`). In a Matroska stream, `MKV0` is the head, `MKV1` is a cluster that begins
    /// with a key frame, and `MKV2` is a cluster that needs the clusters before it.
    pub format: [u8; 4],
    /// Number that the camera gave the picture, or [`NO_SEQUENCE`].
    pub sequence: u64,
    /// Time of the picture in the stream, in nanoseconds; 0 if it has none.
    pub presented_nanos: u64,
    /// Time of the first common instant of the run, `CLOCK_MONOTONIC`, in nanoseconds.
    pub grid_start_nanos: u64,
    /// Common instants per second, before `frame_step` is applied.
    pub grid_rate_hz: f64,
    /// Bytes from one row of raw pixels to the next; 0 for formats without rows.
    pub bytes_per_row: u32,
    /// Number of times that the camera had been opened before this connection.
    pub connection: u32,
    /// Name of the camera, UTF-8, padded with zeros; a longer name is truncated.
    pub name: [u8; MAX_NAME],
    /// Explicit padding.
    pub reserved: [u64; 7],
}
