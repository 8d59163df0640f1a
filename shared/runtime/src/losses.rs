//! Processes that were given up, marked in files beside the deployment's sockets: others need not wait for them.

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
    /// At most.
    pub limit: Duration,
    /// If as many processes were given up as receivers are missing.
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
    /// Those of a deployment.
    pub fn of(namespace: &Namespace) -> Self {
        Self {
            folder: namespace.root().to_owned(),
        }
    }

    /// Marks a process. The file is empty, which a full `/dev/shm` has room for.
    ///
    /// # Errors
    ///
    /// The file cannot be created; senders then wait for the process as long as for any other.
    pub fn note(&self, process: &str) -> io::Result<()> {
        File::create(self.folder.join(process).with_added_extension(MARK)).map(drop)
    }

    /// How many processes are marked.
    pub(crate) fn count(&self) -> usize {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let is_mark = |path: PathBuf| path.extension().is_some_and(|extension| extension == MARK);
        entries.filter(|entry| is_mark(entry.path())).count()
    }
}
