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
    /// Returns true if a process was given up, or had not finished when all others had.
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
    /// Its name.
    pub name: String,
    /// Its service.
    pub service: String,
    /// How it ended.
    pub state: State,
    /// How often it was restarted.
    pub restarts: u32,
    /// Its counts, over all restarts.
    pub counts: Counts,
    /// Its last heartbeat.
    pub last: Option<Health>,
    /// Its last metrics; not checked.
    pub measured: Option<Metrics>,
}

/// The state of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It runs.
    Running,
    /// It has received the end of stream and sent it on.
    Finished,
    /// It was stopped before it had finished.
    Stopped,
    /// It failed too often.
    GivenUp,
}

/// The counts of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Messages received.
    pub n_received: u64,
    /// Messages sent.
    pub n_sent: u64,
    /// Messages or frames that were lost before they reached it, or came too late.
    pub n_dropped: u64,
    /// Peak memory over all restarts, including shared memory, bytes.
    pub peak_memory_bytes: u64,
    /// Frames that the processor computed because the GPU was lost.
    pub n_without_gpu: u64,
    /// Messages that it refused, by cause ([`Refusal::ALL`]); includes heartbeats on its topic that were not
    /// its own.
    pub refused: [u64; Refusal::N],
}

impl Counts {
    /// Adds the counts since the last start.
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
