//! The response maps of one image.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_LEVELS, Stamp, Status, Timing};

/// Travels as the user header of the responses: `[f32]`, those of an `fmp::Scope`, without gaps. Its
/// alignment makes them begin on a cache line.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, Pod, Zeroable)]
#[type_name("EvidenceHeader.v3")]
#[repr(C)]
#[repr(align(64))]
pub struct EvidenceHeader {
    /// Which frame.
    pub stamp: Stamp,
    /// When.
    pub timing: Timing,
    /// Width of the image the evidence is of, pixels.
    pub width: u32,
    /// Height of the image, pixels.
    pub height: u32,
    /// Whether there is evidence.
    pub status: Status,
    /// How many entries of `levels` count.
    pub n_levels: u32,
    /// First column of the image that there are responses of, and the one after the last, pixels.
    pub x: [u32; 2],
    /// First row, and the one after the last, pixels.
    pub y: [u32; 2],
    /// First level that there are responses of, and the one after the last.
    pub scope_levels: [u16; 2],
    /// Levels of the pyramid that hold valid values, ascending.
    pub levels: [u16; MAX_LEVELS],
    /// Score of the best pose on each of `levels`, by this view alone; infinite where it is not known.
    pub best: [f32; MAX_LEVELS],
    /// More than any sum on the way to a score on each of `levels`, by this view alone.
    pub size: [f32; MAX_LEVELS],
    /// Keeps the layout free of padding.
    pub reserved: [u32; 11],
}

impl Default for EvidenceHeader {
    fn default() -> Self {
        Self {
            stamp: Stamp::default(),
            timing: Timing::default(),
            width: 0,
            height: 0,
            status: Status::default(),
            n_levels: 0,
            x: [0; 2],
            y: [0; 2],
            scope_levels: [0; 2],
            levels: [0; MAX_LEVELS],
            best: [0.0; MAX_LEVELS],
            size: [0.0; MAX_LEVELS],
            reserved: [0; 11],
        }
    }
}
