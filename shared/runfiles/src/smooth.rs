//! `smooth.json`: report on the smoothing of trajectories.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::ReadError;
use crate::read::{parse, to_text};

/// The file `smooth.json`: report on how `pose3d-smooth.jsonl` was made.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SmoothReport {
    /// Cutoff of the low-pass filter, in Hz, if there is one.
    pub cutoff_hz: Option<f64>,
    /// Delay of the positions, in milliseconds; 0 for methods that also use later measurements.
    pub delay_ms: f64,
    /// Reasons to doubt the result, in words; empty if there are none.
    pub doubts: Vec<String>,
    /// Maximum time between measurements, in seconds, for the gap to be filled.
    pub fill_s: f64,
    /// Name of the method: `rts`, `butterworth`, `kalman` or `none`.
    pub method: String,
    /// Number of lines.
    pub n_frames: u64,
    /// The people, by ascending id. Each was smoothed separately.
    pub people: Vec<SmoothedPerson>,
    /// Frames per second: the inverse of the median time between two frames.
    pub rate_hz: Option<f64>,
    /// Maximum distance of the frames' times from the uniform grid to which they were interpolated, in milliseconds.
    pub resampled_ms: Option<f64>,
    /// Version of the file, [`crate::VERSION`].
    pub schema_version: u64,
}

/// Smoothing of one person over the run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SmoothedPerson {
    /// Lengths of bones that were kept constant, by the names of both joints, in metres.
    pub bones: BTreeMap<String, f64>,
    /// Frames at which another person begins. Nothing was smoothed across them.
    pub frames_of_breaks: Vec<u64>,
    /// Ids of the person within the run. A person has several ids if no frame contains two people and the followed person had several ids
    /// one after the other.
    pub ids: Vec<u64>,
    /// Smoothing of every joint and keypoint, by name.
    pub joints: BTreeMap<String, SmoothedJoint>,
    /// Counts of frames at which left and right were not certain.
    pub unsure: Unsure,
}

/// Counts of frames at which left and right were not certain, by what was done with them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Unsure {
    /// Number of frames in which left and right were swapped, because this fits the frames before and after.
    pub exchanged: usize,
    /// Number of frames that were kept as measured.
    pub kept: usize,
    /// Number of frames whose left and right joints were left out.
    pub left_out: usize,
}

/// Smoothing of one joint over the run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SmoothedJoint {
    /// Number of frames without a position.
    pub absent: usize,
    /// Factor by which the joint's covariances must be multiplied; `None` if the method does not estimate it.
    pub covariance_scale: Option<f64>,
    /// Number of frames in which the measurement named after the same joint on the other side was used.
    pub exchanged: usize,
    /// Number of frames that were filled.
    pub filled: usize,
    /// Spectral density of the joint's jerk, in m²/s⁵; `None` if the method does not use it.
    pub jerk_m2_s5: Option<f64>,
    /// Number of frames that were measured.
    pub measured: usize,
    /// Number of frames whose measurement was rejected and filled.
    pub rejected: usize,
}

impl SmoothReport {
    /// Name of the file.
    pub const FILE: &'static str = "smooth.json";

    /// Parses the text of the file.
    ///
    /// # Errors
    ///
    /// Returns a [`ReadError`] on failure.
    pub fn parse(text: &str) -> Result<Self, ReadError> {
        parse(text)
    }

    /// Returns the text of the file.
    ///
    /// # Errors
    ///
    /// Never fails for this type. The error type is that of `serde_json`.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        to_text(self)
    }
}
