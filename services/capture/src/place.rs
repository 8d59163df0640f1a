//! Where a restarted camera goes on: the next frame, kept in a file beside the deployment's sockets.

use std::fs;
use std::io;
use std::path::PathBuf;

/// The number of frames that were sent, which outlives the process.
#[derive(Debug)]
pub(crate) struct Place {
    file: PathBuf,
}

impl Place {
    pub(crate) fn new(file: PathBuf) -> Self {
        Self { file }
    }

    /// Frames sent by earlier lives of the process; none if nothing is known.
    pub(crate) fn sent(&self) -> u64 {
        let text = fs::read_to_string(&self.file).unwrap_or_default();
        text.trim().parse().unwrap_or(0)
    }

    /// Notes that so many frames have been sent.
    ///
    /// # Errors
    ///
    /// The file cannot be written; then a restart would begin anew.
    pub(crate) fn note(&self, n_sent: u64) -> io::Result<()> {
        fs::write(&self.file, n_sent.to_string())
    }
}
