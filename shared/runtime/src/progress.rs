//! Counter that increases as long as a process makes progress.

use core::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// Counts iterations of a process's main loop. Clones share the count.
///
/// Waiting for messages, waiting for a slow receiver and sending are counted automatically. A computation that may take seconds must call
/// [`tick`](Self::tick) repeatedly. If it counts its own steps, it can be [followed](Self::follow) instead. Without either, the supervisor
/// assumes that the process hangs.
#[derive(Clone, Default)]
pub struct Progress {
    count: Arc<AtomicU64>,
    steps: Arc<OnceLock<Steps>>,
}

type Steps = Box<dyn Fn() -> u64 + Send + Sync>;

impl Progress {
    /// Counts one iteration.
    pub fn tick(&self) {
        self.count.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts every step of a computation as an iteration.
    ///
    /// Returns false if a computation is already followed: then `n_steps` will not be called.
    ///
    /// * `n_steps`: number of steps so far. Called from another thread, once per heartbeat.
    pub fn follow(&self, n_steps: impl Fn() -> u64 + Send + Sync + 'static) -> bool {
        self.steps.set(Box::new(n_steps)).is_ok()
    }

    /// Returns the number of iterations and steps so far.
    pub fn count(&self) -> u64 {
        let n_steps = self.steps.get().map_or(0, |n_steps| n_steps());
        self.count.load(Ordering::Relaxed).wrapping_add(n_steps)
    }
}

impl fmt::Debug for Progress {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        to.debug_tuple("Progress").field(&self.count()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_a_followed_computation_count_as_iterations() {
        let (progress, steps) = (Progress::default(), Arc::new(AtomicU64::new(5)));
        progress.tick();
        let counted = Arc::clone(&steps);
        assert!(progress.follow(move || counted.load(Ordering::Relaxed)));
        let seen_elsewhere = progress.clone();
        assert_eq!(seen_elsewhere.count(), 6);
        steps.fetch_add(2, Ordering::Relaxed);
        assert_eq!(seen_elsewhere.count(), 8);
        assert!(!progress.follow(|| 1000), "only one is followed");
        assert_eq!(seen_elsewhere.count(), 8);
    }
}
