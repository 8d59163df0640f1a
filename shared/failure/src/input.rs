//! Input files as text; an error names the file, then what is wrong with it.

use std::io::ErrorKind;
use std::path::Path;

use crate::{ExitKind, Failure};

/// Reads a text file, and names it if that fails.
///
/// # Errors
///
/// It cannot be read, or is not UTF-8.
pub fn read_text(file: &Path) -> Result<String, Failure> {
    files::read_text(file, files::RESULTS).map_err(|error| match error.kind() {
        ErrorKind::InvalidData => no_text(file),
        _ => in_file(file, &error),
    })
}

/// A file that should be text and is not UTF-8.
pub fn no_text(file: &Path) -> Failure {
    let message = format!("{} is not text: it is not UTF-8", file.display());
    Failure::new(ExitKind::Input, message)
}

/// An input that is wrong: the file, then what is wrong with it.
pub fn in_file(file: &Path, error: &dyn std::error::Error) -> Failure {
    Failure::new(ExitKind::Input, format!("{}: {error}", file.display()))
}
