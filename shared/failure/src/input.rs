//! Input files as text. An error names the file, then the problem with it.

use std::io::ErrorKind;
use std::path::Path;

use crate::{ExitKind, Failure};

/// Reads a text file. An error names the file.
///
/// # Errors
///
/// Fails if the file cannot be read, or is not UTF-8.
pub fn read_text(file: &Path) -> Result<String, Failure> {
    files::read_text(file, files::RESULTS).map_err(|error| match error.kind() {
        ErrorKind::InvalidData => no_text(file),
        _ => in_file(file, &error),
    })
}

/// Returns the failure for a file that should be text but is not UTF-8.
pub fn no_text(file: &Path) -> Failure {
    let message = format!(
        "{} is not a text file: its content is not UTF-8",
        file.display()
    );
    Failure::new(ExitKind::Input, message)
}

/// Returns the failure for a wrong input: the file, then the problem with it.
pub fn in_file(file: &Path, error: &dyn std::error::Error) -> Failure {
    Failure::new(ExitKind::Input, format!("{}: {error}", file.display()))
}
