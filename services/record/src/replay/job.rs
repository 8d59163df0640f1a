//! The settings of the process.

use core::time::Duration;
use std::path::PathBuf;

use crate::replay::Pace;

/// The settings of the process.
#[derive(Debug)]
pub struct Job {
    /// Path of the recording.
    pub file: PathBuf,
    /// The topics that the replaced process publishes. The first topic determines the end of the stream.
    pub outputs: Vec<Output>,
    /// Replay speed.
    pub pace: Pace,
    /// Interval between used frames, in frames of the footage. It is needed for a recording without an end of stream.
    pub frame_step: u64,
    /// Time that the process waits for receivers.
    pub patience: Duration,
}

/// A topic that is replayed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// Name of the topic.
    pub topic: String,
    /// Number of processes that subscribe to the topic. If there are no such processes, nothing is sent on the topic.
    pub n_receivers: usize,
}
