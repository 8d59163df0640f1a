//! `times.jsonl`: when every frame was taken, answered and turned into a result.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::nullable::nullable;

/// A line of `times.jsonl`. Times are milliseconds since the run was planned (`CLOCK_MONOTONIC`), 0 for what was
/// before it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimesLine {
    /// How often the process that sent the result had been restarted.
    pub epoch: u32,
    /// Number of the frame in the footage.
    pub frame: u64,
    /// When the result was sent.
    pub sent_ms: f64,
    /// The views, by camera.
    pub views: BTreeMap<String, ViewTimes>,
}

/// Times of one view of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ViewTimes {
    /// The frame of its camera; none if none came.
    #[serde(deserialize_with = "nullable")]
    pub camera: Option<CameraTimes>,
    /// The answer of its pose process; none if none came.
    #[serde(deserialize_with = "nullable")]
    pub pose: Option<PoseTimes>,
}

/// A frame that a camera's process sent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CameraTimes {
    /// When it was taken, milliseconds.
    pub captured_ms: f64,
    /// How often the process had been restarted.
    pub epoch: u32,
    /// When it was sent, milliseconds.
    pub sent_ms: f64,
}

/// An answer of a pose process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoseTimes {
    /// How often the process had been restarted.
    pub epoch: u32,
    /// When it was sent, milliseconds.
    pub sent_ms: f64,
}
