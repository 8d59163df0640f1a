//! A file of lines that are there whole or not at all.

use std::fs::File;
use std::io::{self, Write as _};

/// A file that grows by whole lines, however full the disk is.
#[derive(Debug)]
pub(crate) struct Lines {
    file: File,
    len: u64,
}

impl Lines {
    /// * `file`: opened for appending.
    ///
    /// # Errors
    ///
    /// Its length cannot be found out.
    pub(crate) fn new(file: File) -> io::Result<Self> {
        let len = file.metadata()?.len();
        Ok(Self { file, len })
    }

    /// Whether nothing has been written yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Appends lines; if that fails, what was written of them is taken back.
    ///
    /// # Errors
    ///
    /// The first error of the operating system.
    pub(crate) fn append(&mut self, text: &str) -> io::Result<()> {
        let written = self.file.write_all(text.as_bytes());
        match &written {
            Ok(()) => self.len += text.len() as u64,
            Err(_) => {
                if let Err(error) = self.file.set_len(self.len) {
                    tracing::debug!(%error, "cannot take back half a line");
                }
            }
        }
        written
    }
}
