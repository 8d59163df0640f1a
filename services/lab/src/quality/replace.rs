//! Files that are replaced as a whole, so that they are always complete.

use std::path::Path;

use failure::{ExitKind, Failure};

/// Writes a file completely, or keeps the previous file.
pub(super) fn replace(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::replace(path, bytes).map_err(|error| {
        let message = format!("cannot write {}: {error}", path.display());
        Failure::new(ExitKind::Run, message)
    })
}
