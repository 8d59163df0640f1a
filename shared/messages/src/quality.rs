//! How far off a view is expected to be.

use iceoryx2::prelude::ZeroCopySend;

use crate::{MAX_PARTS, Stamp, Status, Timing};

/// The expected single-view error of every part: the paper's sigma (section 4.3).
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("ViewQuality.v1")]
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
}
