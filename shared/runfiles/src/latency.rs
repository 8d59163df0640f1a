//! `latency.json`: where the time went, from the stamps in the messages.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::ReadError;
use crate::nullable::nullable;
use crate::read::{parse, to_text};

/// Percentiles of one duration, milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Percentiles {
    /// How many were measured.
    pub count: u64,
    /// The longest.
    pub max_ms: f64,
    /// Half are shorter.
    pub p50_ms: f64,
    /// 999 of 1000 are shorter; the longest where fewer were measured.
    pub p99_9_ms: f64,
    /// 99 of 100 are shorter.
    pub p99_ms: f64,
}

/// Use of the time, over all frames.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LatencyReport {
    /// From capture to the result.
    pub end_to_end: Percentiles,
    /// Share of the end-to-end time that is not computation on the way that took longest.
    #[serde(deserialize_with = "nullable")]
    pub share_not_computation: Option<f64>,
    /// Share of the end-to-end time that is transport.
    #[serde(deserialize_with = "nullable")]
    pub share_transport: Option<f64>,
    /// Share of the end-to-end time spent waiting for busy processes.
    #[serde(deserialize_with = "nullable")]
    pub share_waiting: Option<f64>,
    /// Computing time of every stage.
    pub stages: BTreeMap<String, Percentiles>,
    /// From sent to received, the receiver being free: what the transport costs.
    pub transport: BTreeMap<String, Percentiles>,
    /// From sent to received while the receiver was still busy with something earlier.
    pub waiting: BTreeMap<String, Percentiles>,
}

impl LatencyReport {
    /// Name of the file.
    pub const FILE: &'static str = "latency.json";

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
