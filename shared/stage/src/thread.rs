//! A thread that writes files, so that no sender waits for the disk.

use core::time::Duration;
use std::thread::{Builder, JoinHandle};

use failure::{ExitKind, Failure, OrFail as _};
use runtime::Service;

/// A thread that ends when its queue is closed.
#[derive(Debug)]
pub struct WriterThread {
    handle: JoinHandle<()>,
}

impl WriterThread {
    /// Starts the thread.
    ///
    /// # Errors
    ///
    /// Returns [`ExitKind::Run`] if the thread cannot be started.
    pub fn start(write: impl FnOnce() + Send + 'static) -> Result<Self, Failure> {
        let builder = Builder::new().name("writer".to_owned());
        let handle = builder.spawn(write).or_fail(ExitKind::Run)?;
        Ok(Self { handle })
    }

    /// Waits until everything has been written, while heartbeats continue. The sending end of the queue must have been dropped before.
    ///
    /// # Errors
    ///
    /// Returns [`ExitKind::Run`] if the thread panicked.
    pub fn finish(self, service: &Service) -> Result<(), Failure> {
        while !self.handle.is_finished() {
            service.progress().tick();
            std::thread::sleep(Duration::from_millis(20));
        }
        let panicked = |_| Failure::new(ExitKind::Run, "the writing thread panicked");
        self.handle.join().map_err(panicked)
    }
}
