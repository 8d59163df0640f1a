//! Files that are whole at any time.

use std::path::Path;

use failure::{ExitKind, Failure};

/// Writes a file that is complete, or the one before it stays.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::replace(path, bytes).map_err(|error| {
        let message = format!("cannot write {}: {error}", path.display());
        Failure::new(ExitKind::Run, message)
    })
}
