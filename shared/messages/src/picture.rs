//! One picture of a live camera, as the camera sent it.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_NAME, Stamp, Status, Timing};

/// Replaces the number of a camera that does not number its pictures.
pub const NO_SEQUENCE: u64 = u64::MAX;

/// The user header of a picture of a live camera as it came, for recordings: `[u8]`, a JPEG file, raw pixels, or a piece of a
/// Matroska stream.
///
/// The frame of its stamp is its number: pictures that were not sent are counted by the gaps, from 0 at every start of the process.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("PictureHeader.v1")]
#[repr(C)]
#[repr(align(64))]
pub struct PictureHeader {
    /// Its number, and when it was taken.
    pub stamp: Stamp,
    /// When it was received and sent.
    pub timing: Timing,
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Says that there is a picture, or why there is none: [`Status::OK`], [`Status::DAMAGED`] or [`Status::END`].
    pub status: Status,
    /// Format of the bytes, four letters: those of Linux (`MJPG`, `YUYV`), `MKV0` for the head of a Matroska stream, `MKV1` for a
    /// cluster of it with one picture.
    pub format: [u8; 4],
    /// The number that the camera gave it, or [`NO_SEQUENCE`].
    pub sequence: u64,
    /// Its time in the stream, nanoseconds; 0 without one.
    pub presented_nanos: u64,
    /// When the first common instant of the run is, `CLOCK_MONOTONIC`, nanoseconds.
    pub grid_start_nanos: u64,
    /// Common instants per second, before `frame_step`.
    pub grid_rate_hz: f64,
    /// Bytes from one row of raw pixels to the next; 0 for what has no rows.
    pub bytes_per_row: u32,
    /// How often the camera had been opened before.
    pub connection: u32,
    /// Name of the camera, UTF-8, padded with zeros; a longer one is cut.
    pub name: [u8; MAX_NAME],
    /// Explicit padding.
    pub reserved: [u64; 7],
}
