//! The outcome of a run.

use messages::{Health, Metrics, Refusal};

/// The outcome of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// All processes, in the order of the plan.
    pub processes: Vec<ProcessOutcome>,
    /// True if the run was stopped before it had finished.
    pub interrupted: bool,
}

impl Outcome {
    /// Returns true if a process was given up, or had not finished when all other processes had.
    pub fn is_degraded(&self) -> bool {
        self.processes.iter().any(|process| match process.state {
            State::GivenUp => true,
            State::Stopped => !self.interrupted,
            State::Running | State::Finished => false,
        })
    }
}

/// The outcome of one process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProcessOutcome {
    /// Name of the process.
    pub name: String,
    /// Service that the process runs.
    pub service: String,
    /// State at the end of the run.
    pub state: State,
    /// Number of restarts.
    pub restarts: u32,
    /// Counts over all restarts.
    pub counts: Counts,
    /// Last heartbeat.
    pub last: Option<Health>,
    /// Last metrics, which have not been checked.
    pub measured: Option<Metrics>,
}

/// The state of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// The process is running.
    Running,
    /// The process has received the end of the stream, and sent it on.
    Finished,
    /// The process was stopped before it had finished.
    Stopped,
    /// The process failed too often.
    GivenUp,
}

/// The counts of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Number of received messages.
    pub n_received: u64,
    /// Number of sent messages.
    pub n_sent: u64,
    /// Number of messages or frames that were lost before they reached the process, or came too late.
    pub n_dropped: u64,
    /// Peak memory over all restarts, including shared memory, in bytes.
    pub peak_memory_bytes: u64,
    /// Number of frames that the processor computed because the GPU was lost.
    pub n_without_gpu: u64,
    /// Messages that the process refused, by cause ([`Refusal::ALL`]). Includes heartbeats that other processes sent on its topic.
    pub refused: [u64; Refusal::N],
}

impl Counts {
    /// Returns the sum of these counts and the counts since the last start.
    pub(crate) fn and(self, health: Option<&Health>) -> Self {
        health.map_or(self, |health| Self {
            n_received: self.n_received.saturating_add(health.n_received),
            n_sent: self.n_sent.saturating_add(health.n_sent),
            n_dropped: self.n_dropped.saturating_add(health.n_dropped),
            peak_memory_bytes: self.peak_memory_bytes.max(health.peak_memory_bytes),
            n_without_gpu: self.n_without_gpu.saturating_add(health.n_without_gpu),
            refused: std::array::from_fn(|cause| {
                self.refused[cause].saturating_add(health.refused[cause])
            }),
        })
    }
}
