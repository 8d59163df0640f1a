//! A file that contains only complete lines.

use std::fs::File;
use std::io::{self, Write as _};

/// A file to which only complete lines are appended, even if the disk becomes full.
#[derive(Debug)]
pub(crate) struct Lines {
    file: File,
    len: u64,
    lacks_some: bool,
}

impl Lines {
    /// Takes over a file.
    ///
    /// * `file`: opened for appending.
    ///
    /// # Errors
    ///
    /// Fails if the length of the file cannot be determined.
    pub(crate) fn new(file: File) -> io::Result<Self> {
        let len = file.metadata()?.len();
        Ok(Self {
            file,
            len,
            lacks_some: false,
        })
    }

    /// Returns true if nothing has been written yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns true if some lines could not be written.
    pub(crate) fn lacks_some(&self) -> bool {
        self.lacks_some
    }

    /// Appends lines. On failure, a partly written line is removed again.
    ///
    /// # Errors
    ///
    /// Fails with the first error of the operating system.
    pub(crate) fn append(&mut self, text: &str) -> io::Result<()> {
        let written = self.file.write_all(text.as_bytes());
        if written.is_ok() {
            self.len += text.len() as u64;
            return written;
        }
        self.lacks_some = true;
        if let Err(error) = self.file.set_len(self.len) {
            tracing::debug!(%error, "cannot remove an incomplete line");
        }
        written
    }
}
