//! What became of a run.

use messages::{Health, Metrics, Refusal};

/// What became of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// All processes, in the order of the plan.
    pub processes: Vec<ProcessOutcome>,
    /// Whether the run was stopped before it was done.
    pub interrupted: bool,
}

impl Outcome {
    /// Whether a process was given up on the way, or was not done when all others were.
    pub fn is_degraded(&self) -> bool {
        self.processes.iter().any(|it| match it.state {
            State::GivenUp => true,
            State::Stopped => !self.interrupted,
            State::Running | State::Finished => false,
        })
    }
}

/// What became of a process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProcessOutcome {
    /// Its name.
    pub name: String,
    /// Which service it is.
    pub service: String,
    /// How it ended.
    pub state: State,
    /// How often it was restarted.
    pub restarts: u32,
    /// What it did, all its lives together.
    pub counts: Counts,
    /// Its last sign of life.
    pub last: Option<Health>,
    /// What its last life has said last of its times and counts; not checked.
    pub measured: Option<Metrics>,
}

/// How a process stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// It works.
    Running,
    /// It has seen the end of the footage and passed it on.
    Finished,
    /// It was asked to end before it was done.
    Stopped,
    /// It failed too often.
    GivenUp,
}

/// What a process did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Messages taken in.
    pub n_received: u64,
    /// Messages sent out.
    pub n_sent: u64,
    /// Messages or frames lost before they reached it, or that came too late.
    pub n_dropped: u64,
    /// Most memory that any of its lives has held, shared memory included, bytes.
    pub peak_memory_bytes: u64,
    /// Messages that it refused, by cause ([`Refusal::ALL`]); signs of life that were not its own count
    /// here too.
    pub refused: [u64; Refusal::N],
}

impl Counts {
    /// With what a process has done since it was started.
    pub(crate) fn and(self, health: Option<&Health>) -> Self {
        health.map_or(self, |health| Self {
            n_received: self.n_received.saturating_add(health.n_received),
            n_sent: self.n_sent.saturating_add(health.n_sent),
            n_dropped: self.n_dropped.saturating_add(health.n_dropped),
            peak_memory_bytes: self.peak_memory_bytes.max(health.peak_memory_bytes),
            refused: std::array::from_fn(|it| self.refused[it].saturating_add(health.refused[it])),
        })
    }
}
