//! State shared by the threads that search pictures.

use std::sync::atomic::{AtomicUsize, Ordering};

use failure::{Console, Stop};

use super::observer::Observer;

/// State that all threads share.
pub(super) struct Work<'a> {
    pub(super) observer: Observer,
    pub(super) stop: Stop,
    console: &'a dyn Console,
    n_done: AtomicUsize,
    n_lost: AtomicUsize,
}

impl<'a> Work<'a> {
    pub(super) fn new(observer: Observer, stop: Stop, console: &'a dyn Console) -> Self {
        Self {
            observer,
            stop,
            console,
            n_done: AtomicUsize::new(0),
            n_lost: AtomicUsize::new(0),
        }
    }

    /// Returns the number of pictures without a sample.
    pub(super) fn n_lost(&self) -> usize {
        self.n_lost.load(Ordering::Relaxed)
    }

    /// Counts pictures that were searched.
    pub(super) fn done(&self, n: usize, n_lost: usize) {
        const EVERY: usize = 100;
        self.n_lost.fetch_add(n_lost, Ordering::Relaxed);
        let before = self.n_done.fetch_add(n, Ordering::Relaxed);
        if before / EVERY != (before + n) / EVERY {
            self.console.message(&format!("{} pictures", before + n));
        }
    }
}
