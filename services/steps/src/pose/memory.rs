//! State of a view that is kept from frame to frame.

use fmp::Tracker;
use keypoints::files::SeenKeypoints;
use messages::Stamp;
use pipeline::{LookBudget, NetworkMemory};

use crate::pose::job::{Job, Looks};

/// State that is kept from frame to frame.
pub(crate) enum Memory {
    /// Tracker with the last pose, and buffer for filter responses that are not written to shared memory.
    Filters(Tracker, Vec<f32>),
    Network(Box<NetworkState>),
    Keypoints(Box<KeypointState>),
}

/// Time without a person after which a warning is logged, in nanoseconds: a minute.
const LONG_NANOS: u64 = 60_000_000_000;

/// State of a view whose frames a network searches.
#[derive(Debug, Default)]
pub(crate) struct NetworkState {
    pub(crate) memory: NetworkMemory,
    /// Budget for the runs of the network, if the cores limit them.
    pub(crate) budget: Option<LookBudget>,
    /// Time of the last person or the last warning, and number of frames since.
    pub(crate) nobody: Option<(u64, u64)>,
    /// True if a failure of the network was reported.
    pub(crate) has_failed: bool,
}

impl NetworkState {
    pub(crate) fn new(looks: Looks) -> Self {
        Self {
            budget: match looks {
                Looks::Affordable(budget) => Some(budget),
                Looks::All | Looks::Fixed(_) => None,
            },
            ..Self::default()
        }
    }

    /// Begins a frame, and limits the runs of the network in it.
    pub(crate) fn begin(&mut self, frame: u64, job: &Job) {
        self.memory.begin(frame, job.most_apart);
        self.memory.allow(match job.looks {
            Looks::Fixed(looks) => Some(looks),
            Looks::All | Looks::Affordable(_) => self.budget.as_ref().and_then(LookBudget::looks),
        });
    }

    /// Warns if nobody has been seen for a minute.
    pub(crate) fn sees(&mut self, is_somebody: bool, stamp: &Stamp) {
        let now = stamp.captured_at_nanos;
        let (since, n) = self.nobody.unwrap_or((now, 0));
        if is_somebody {
            self.nobody = None;
        } else if now.saturating_sub(since) >= LONG_NANOS {
            tracing::warn!(
                "nobody was seen in the last {} frames ({} s): is there a person, and is the detector suitable (network.detector)?",
                n + 1,
                now.saturating_sub(since) / 1_000_000_000
            );
            self.nobody = Some((now, 0));
        } else {
            self.nobody = Some((since, n + 1));
        }
    }
}

/// State of a view whose keypoints another program found.
#[derive(Debug, Default)]
pub(crate) struct KeypointState {
    pub(crate) memory: NetworkMemory,
    pub(crate) people: Vec<SeenKeypoints>,
    /// True if an unreadable file was reported.
    pub(crate) has_failed: bool,
}
