//! `smooth.json`: how trajectories were smoothed.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::ReadError;
use crate::read::{parse, to_text};

/// The file `smooth.json`: how `pose3d-smooth.jsonl` was made.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SmoothReport {
    /// Cutoff of the low-pass filter, Hz, where there is one.
    pub cutoff_hz: Option<f64>,
    /// Amount by which the positions are late, milliseconds; 0 for methods that look ahead.
    pub delay_ms: f64,
    /// Reasons to doubt the result, in words; an empty list is good.
    pub doubts: Vec<String>,
    /// The longest time between measurements that was filled, seconds.
    pub fill_s: f64,
    /// `rts`, `butterworth`, `kalman` or `none`.
    pub method: String,
    /// Lines.
    pub n_frames: u64,
    /// The people, by ascending identity; each was smoothed alone.
    pub people: Vec<SmoothedPerson>,
    /// Frames per second: the inverse of the median time between two.
    pub rate_hz: Option<f64>,
    /// Amount by which the instants are off the uniform grid that they were interpolated to, at most, milliseconds.
    pub resampled_ms: Option<f64>,
    /// [`crate::VERSION`].
    pub schema_version: u64,
}

/// One person over the run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SmoothedPerson {
    /// Lengths of bones that were kept constant, by the names of both joints, metres.
    pub bones: BTreeMap<String, f64>,
    /// Frames in which another person begins: nothing was smoothed across.
    pub frames_of_breaks: Vec<u64>,
    /// Identities within the run: more than one if no frame had two people and the followed person had several, one
    /// after the other.
    pub ids: Vec<u64>,
    /// Every joint and keypoint, by name.
    pub joints: BTreeMap<String, SmoothedJoint>,
    /// Frames whose sides were not certain.
    pub unsure: Unsure,
}

/// Counts of frames whose left and right were not certain, by their treatment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Unsure {
    /// Exchanged: that fits what is before and after.
    pub exchanged: usize,
    /// Kept as measured.
    pub kept: usize,
    /// Joints with a side were left out.
    pub left_out: usize,
}

/// One joint over the run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SmoothedJoint {
    /// Frames without a position.
    pub absent: usize,
    /// Factor of its covariances; `None` where the method does not estimate it.
    pub covariance_scale: Option<f64>,
    /// Frames in which it was measured as the joint of the other side.
    pub exchanged: usize,
    /// Frames that were filled.
    pub filled: usize,
    /// Spectral density of its jerk, m²/s⁵; none where the method does not ask.
    pub jerk_m2_s5: Option<f64>,
    /// Frames that were measured.
    pub measured: usize,
    /// Frames whose measurement was rejected and filled.
    pub rejected: usize,
}

impl SmoothReport {
    /// Name of the file.
    pub const FILE: &'static str = "smooth.json";

    /// Reads the file.
    ///
    /// # Errors
    ///
    /// [`ReadError`].
    pub fn parse(text: &str) -> Result<Self, ReadError> {
        parse(text)
    }

    /// The file.
    ///
    /// # Errors
    ///
    /// None; those of `serde_json`.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        to_text(self)
    }
}
