//! A counter that moves as long as a process does.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts turns of a process's main loop; clones share the count.
///
/// Waiting for messages, waiting for a slow receiver and sending count by themselves. A computation that may
/// take seconds calls [`tick`](Self::tick) in between, or the supervisor will think that it hangs.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    count: Arc<AtomicU64>,
}

impl Progress {
    /// Counts one turn.
    pub fn tick(&self) {
        self.count.fetch_add(1, Ordering::Relaxed);
    }

    /// How many there have been.
    pub fn count(&self) -> u64 {
        self.count.load(Ordering::Relaxed)
    }
}
