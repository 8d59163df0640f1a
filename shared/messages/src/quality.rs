//! Expected errors of a view.

use bytemuck_derive::{Pod, Zeroable};
use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_PARTS, Stamp, Status, Timing};

/// The expected single-view error of every part: the paper's sigma (section 4.3).
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend, Pod, Zeroable)]
#[type_name("ViewQuality.v2")]
#[repr(C)]
pub struct ViewQuality {
    /// Identity of the frame and the view.
    pub stamp: Stamp,
    /// Times at which the input arrived and the message was sent.
    pub timing: Timing,
    /// States whether there is a prediction and, if not, why. Without a prediction, fusion treats every part as usable.
    pub status: Status,
    /// Number of valid parts.
    pub n_parts: u32,
    /// Expected distance of the part's centre from the truth, in pixels of the frame.
    pub sigma_px: [f32; MAX_PARTS],
    /// Number of valid thresholds: the number of parts, or 0.
    pub n_thresholds: u32,
    /// Fingerprint of the network's file; 0 without a network.
    pub network: u32,
    /// Error above which a part is switched off, in pixels of the frame, from the network's file.
    pub tau_px: [f32; MAX_PARTS],
    /// Input tile of the network: `[x1, y1, x2, y2]`, the centres of its outermost pixels in pixels of the frame.
    pub tile: [f32; 4],
    /// Duration of the prediction, in nanoseconds.
    pub took_nanos: u64,
}
