//! The response maps of one image.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_CANDIDATES, MAX_LEVELS, Stamp, Status, Timing};

/// Grid of the cells of one person's maps in the picture: `posenetwork::MapGrid`.
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("GridMessage.v2")]
#[repr(C)]
pub struct GridMessage {
    /// Centre of the first cell, in pixels of the frame.
    pub first_px: [f64; 2],
    /// Distance between neighbouring cells, across and down, in pixels of the frame.
    pub cell_px: [f64; 2],
    /// Number of columns and rows.
    pub size: [u32; 2],
    /// Form of the values: 0 for a value per cell, 1 for the peak of each joint.
    pub kind: u32,
    /// Explicit padding.
    pub padding: u32,
}

/// The user header of a sample of `[f32]`, without gaps.
///
/// With the network method, the sample has the maps of one person after the other, in the order of the candidates: `[joint][row][column]`.
/// For keypoints of another program, it has the peak of each joint: `[joint][column, row, evidence, sigma]`, in cells.
/// With the paper's method, it has the responses of an `fmp::Scope`. The header's alignment places the values at the start of a cache line.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend, Pod, Zeroable)]
#[type_name("EvidenceHeader.v5")]
#[repr(C)]
#[repr(align(64))]
pub struct EvidenceHeader {
    /// Identity of the frame.
    pub stamp: Stamp,
    /// Times at which the input arrived and the message was sent.
    pub timing: Timing,
    /// Width of the image, in pixels.
    pub width: u32,
    /// Height of the image, in pixels.
    pub height: u32,
    /// States whether there is evidence and, if not, why.
    pub status: Status,
    /// Number of valid entries of `levels`.
    pub n_levels: u32,
    /// Number of people with maps; 0 with the paper's method. Only the paper's method uses the fields after `people`.
    pub n_people: u32,
    /// Explicit padding.
    pub padding: u32,
    /// The maps of each person.
    pub people: [GridMessage; MAX_CANDIDATES],
    /// First column of the image with responses, and the column after the last, in pixels.
    pub x: [u32; 2],
    /// First row of the image with responses, and the row after the last, in pixels.
    pub y: [u32; 2],
    /// First level that has responses, and the level after the last.
    pub scope_levels: [u16; 2],
    /// Levels of the pyramid with valid values, ascending.
    pub levels: [u16; MAX_LEVELS],
    /// Score of the best pose on each of `levels`, from this view alone; infinite if unknown.
    pub best: [f32; MAX_LEVELS],
    /// Upper bound of all partial sums of a score on each of `levels`, from this view alone.
    pub size: [f32; MAX_LEVELS],
    /// Explicit padding.
    pub reserved: [u32; 9],
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
            n_people: 0,
            padding: 0,
            people: [GridMessage::default(); MAX_CANDIDATES],
            x: [0; 2],
            y: [0; 2],
            scope_levels: [0; 2],
            levels: [0; MAX_LEVELS],
            best: [0.0; MAX_LEVELS],
            size: [0.0; MAX_LEVELS],
            reserved: [0; 9],
        }
    }
}
