//! `latency.json`: how the time of a run was used, computed from the stamps in the messages.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::ReadError;
use crate::nullable::nullable;
use crate::read::{parse, to_text};

/// Percentiles of one duration, in milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Percentiles {
    /// Number of measured durations.
    pub count: u64,
    /// Longest duration.
    pub max_ms: f64,
    /// Median duration.
    pub p50_ms: f64,
    /// Duration that 999 of 1000 measurements do not exceed; the longest duration if there are fewer measurements.
    pub p99_9_ms: f64,
    /// Duration that 99 of 100 measurements do not exceed.
    pub p99_ms: f64,
}

/// How the time was used, over all frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LatencyReport {
    /// Time from capture to the result.
    pub end_to_end: Percentiles,
    /// Fraction of the end-to-end time that is not computation, on the slowest path through the pipeline.
    #[serde(deserialize_with = "nullable")]
    pub share_not_computation: Option<f64>,
    /// Fraction of the end-to-end time that is transport.
    #[serde(deserialize_with = "nullable")]
    pub share_transport: Option<f64>,
    /// Fraction of the end-to-end time spent waiting for busy processes.
    #[serde(deserialize_with = "nullable")]
    pub share_waiting: Option<f64>,
    /// Computing time of every stage.
    pub stages: BTreeMap<String, Percentiles>,
    /// Time from sending to receiving while the receiver was not busy, which is the time that the transport takes.
    pub transport: BTreeMap<String, Percentiles>,
    /// Part of the time between sending and receiving in which the receiver was still busy with earlier work.
    pub waiting: BTreeMap<String, Percentiles>,
}

impl LatencyReport {
    /// Name of the file.
    pub const FILE: &'static str = "latency.json";

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
