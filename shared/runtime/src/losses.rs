//! Processes that the supervisor has given up. They are marked by files beside the deployment's sockets, so that other processes need not
//! wait for them.

use core::time::Duration;
use std::fs::{self, File};
use std::io;
use std::path::PathBuf;

use crate::Namespace;

/// Ending of the file that marks a process.
const MARK: &str = "lost";

/// How long a sender waits for its receivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// Longest wait.
    pub limit: Duration,
    /// Longest wait, if the number of processes that were given up is at least the number of missing receivers.
    pub after_losses: Duration,
}

impl From<Duration> for Patience {
    fn from(limit: Duration) -> Self {
        Self {
            limit,
            after_losses: limit,
        }
    }
}

/// The processes of a deployment that were given up.
#[derive(Debug, Clone)]
pub struct Losses {
    folder: PathBuf,
}

impl Losses {
    /// Returns the processes of a deployment that were given up.
    pub fn of(namespace: &Namespace) -> Self {
        Self {
            folder: namespace.root().to_owned(),
        }
    }

    /// Marks a process as given up. The file is empty, so that it fits even into a full `/dev/shm`.
    ///
    /// # Errors
    ///
    /// Fails if the file cannot be created. Senders then wait for this process as long as for any other.
    pub fn note(&self, process: &str) -> io::Result<()> {
        File::create(self.folder.join(process).with_added_extension(MARK)).map(drop)
    }

    /// Returns the number of marked processes.
    pub(crate) fn count(&self) -> usize {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let is_mark = |path: PathBuf| path.extension().is_some_and(|extension| extension == MARK);
        entries.filter(|entry| is_mark(entry.path())).count()
    }
}
