//! `times.jsonl`: times at which every frame was taken, answered and turned into a result.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::nullable::nullable;

/// A line of `times.jsonl`. Times are milliseconds since the run was planned (`CLOCK_MONOTONIC`), and 0 for earlier
/// events.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimesLine {
    /// Number of restarts of the process that sent the result.
    pub epoch: u32,
    /// Number of the frame in the footage.
    pub frame: u64,
    /// Time at which the result was sent.
    pub sent_ms: f64,
    /// The views, by camera.
    pub views: BTreeMap<String, ViewTimes>,
}

/// Times of one view of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ViewTimes {
    /// Frame of the view's camera; `None` if no frame arrived.
    #[serde(deserialize_with = "nullable")]
    pub camera: Option<CameraTimes>,
    /// Answer of the view's pose process; `None` if no answer arrived.
    #[serde(deserialize_with = "nullable")]
    pub pose: Option<PoseTimes>,
}

/// A frame that a camera's process sent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CameraTimes {
    /// Time at which the frame was taken, in milliseconds.
    pub captured_ms: f64,
    /// Number of restarts of the process.
    pub epoch: u32,
    /// Time at which the frame was sent, in milliseconds.
    pub sent_ms: f64,
}

/// An answer of a pose process.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PoseTimes {
    /// Number of restarts of the process.
    pub epoch: u32,
    /// Time at which the answer was sent, in milliseconds.
    pub sent_ms: f64,
}
