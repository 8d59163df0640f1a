//! Task of the process.

use core::time::Duration;
use std::path::PathBuf;

use crate::replay::Pace;

/// Task of the process.
#[derive(Debug)]
pub struct Job {
    /// The recording.
    pub file: PathBuf,
    /// The topics that the replaced process publishes. The first one determines the end of the stream.
    pub outputs: Vec<Output>,
    /// Replay speed.
    pub pace: Pace,
    /// Distance between the frames used, for a recording without an end of stream.
    pub frame_step: u64,
    /// How long the process waits for receivers.
    pub patience: Duration,
}

/// A topic that is replayed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    /// Its name.
    pub topic: String,
    /// Processes that subscribe to it; with none, nothing is sent on it.
    pub n_receivers: usize,
}
