//! Ends the process if shared memory does not answer.

use core::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use core::time::Duration;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::{io, thread};

/// Watches a thread from another thread, until dropped.
#[derive(Debug)]
pub(crate) struct Stall {
    watched: Arc<Watched>,
    /// The watching thread ends when this sender is dropped.
    _end: SyncSender<()>,
}

#[derive(Debug, Default)]
struct Watched {
    turns: AtomicU64,
    is_outside: AtomicBool,
}

impl Stall {
    /// Starts to watch the current thread.
    ///
    /// * `limit`: longest time between two calls of [`Self::turn`]. Time in which the whole process was stopped does not count.
    /// * `on_stall`: called once, from the other thread.
    ///
    /// # Errors
    ///
    /// Fails if the other thread cannot be started.
    pub(crate) fn watch(limit: Duration, on_stall: fn()) -> io::Result<Self> {
        let watched = Arc::new(Watched::default());
        let (end, ended) = sync_channel(0);
        let seen = Arc::clone(&watched);
        // While a process is stopped, many ticks pass, but it counts only one of them.
        let tick = limit / 60;
        thread::Builder::new().name("stall".to_owned()).spawn(move || {
            let (mut turns, mut waited) = (0, Duration::ZERO);
            while ended.recv_timeout(tick) == Err(RecvTimeoutError::Timeout) {
                let now = seen.turns.load(Ordering::Relaxed);
                if now != turns || seen.is_outside.load(Ordering::Relaxed) {
                    (turns, waited) = (now, Duration::ZERO);
                    continue;
                }
                waited += tick;
                if waited >= limit {
                    on_stall();
                    return;
                }
            }
        })?;
        Ok(Self { watched, _end: end })
    }

    /// Reports that the watched thread is alive.
    pub(crate) fn turn(&self) {
        self.watched.turns.fetch_add(1, Ordering::Relaxed);
    }

    /// Calls a function that may take any time.
    pub(crate) fn outside(&self, call: impl FnOnce()) {
        self.watched.is_outside.store(true, Ordering::Relaxed);
        call();
        self.turn();
        self.watched.is_outside.store(false, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static IS_STALLED: AtomicBool = AtomicBool::new(false);

    #[test]
    fn a_thread_without_turns_is_reported_unless_it_is_outside() {
        let stall = Stall::watch(Duration::from_millis(120), || {
            IS_STALLED.store(true, Ordering::Relaxed);
        })
        .unwrap();
        stall.outside(|| thread::sleep(Duration::from_millis(400)));
        assert!(!IS_STALLED.load(Ordering::Relaxed));
        while !IS_STALLED.load(Ordering::Relaxed) {
            thread::sleep(Duration::from_millis(1));
        }
    }
}
