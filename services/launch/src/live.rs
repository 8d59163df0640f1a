//! A running deployment, observed from another process: its processes and their metrics.

mod describe;
mod snapshot;
mod table;

use core::time::Duration;
use std::time::Instant;

use runtime::{Failure, Namespace, Observer, now_nanos};

pub use describe::{describe, measured};
pub use snapshot::{ProcessSnapshot, Snapshot, State};
pub use table::table;

/// How long to wait for the first metrics of all processes.
const PATIENCE: Duration = Duration::from_secs(2);
const PAUSE: Duration = Duration::from_millis(20);

/// Observes a deployment while it runs.
#[derive(Debug)]
pub struct Live {
    name: String,
    observer: Observer,
}

impl Live {
    /// Connects to a running deployment.
    ///
    /// # Errors
    ///
    /// The deployment does not run, or its topics cannot be opened.
    pub fn open(namespace: &Namespace) -> Result<Self, Failure> {
        Ok(Self {
            name: namespace.name().to_owned(),
            observer: Observer::open(namespace)?,
        })
    }

    /// The current state of all processes.
    ///
    /// # Errors
    ///
    /// The metrics cannot be received.
    pub fn snapshot(&mut self) -> Result<Snapshot, Failure> {
        let supervisor = self.observer.supervisor();
        let observed = self.observer.observe()?;
        Ok(Snapshot::new(
            &self.name,
            supervisor,
            &observed,
            now_nanos(),
        ))
    }

    /// As [`Self::snapshot`], but first waits until every live process has sent metrics, at most two seconds.
    ///
    /// # Errors
    ///
    /// As for [`Self::snapshot`].
    pub fn first_snapshot(&mut self) -> Result<Snapshot, Failure> {
        let begin = Instant::now();
        loop {
            let snapshot = self.snapshot()?;
            if snapshot.is_complete() || begin.elapsed() > PATIENCE || self.is_over() {
                return Ok(snapshot);
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// Whether the deployment is ending; the observer must then be dropped.
    pub fn is_over(&self) -> bool {
        self.observer.is_over()
    }
}
