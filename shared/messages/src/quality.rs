//! How far off a view is expected to be.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_PARTS, Stamp, Status, Timing};

/// The expected single-view error of every part: the paper's sigma (section 4.3).
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("ViewQuality.v2")]
#[repr(C)]
pub struct ViewQuality {
    /// Which frame of which view.
    pub stamp: Stamp,
    /// When.
    pub timing: Timing,
    /// Whether there is a prediction; without one fusion treats every part as usable.
    pub status: Status,
    /// How many parts count.
    pub n_parts: u32,
    /// Expected distance of the part's centre from the truth, pixels of the frame.
    pub sigma_px: [f32; MAX_PARTS],
    /// How many thresholds count: those of all parts, or none.
    pub n_thresholds: u32,
    /// Who predicted: a number made of the bytes of the file; 0 for no network.
    pub network: u32,
    /// Error beyond which a part is switched off, pixels of the frame, as the network's file says.
    pub tau_px: [f32; MAX_PARTS],
    /// What the network looked at: `[x1, y1, x2, y2]`, centres of the outermost pixels of the frame.
    pub tile: [f32; 4],
    /// What the prediction took, nanoseconds.
    pub took_nanos: u64,
}
