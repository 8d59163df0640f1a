//! Failures of networks.

use std::error::Error;
use std::path::Path;

use failure::{ExitKind, Failure};

/// Says that a network cannot be run, and why.
pub(crate) fn refused(path: &Path, error: &(dyn Error + 'static)) -> Failure {
    let message = format!(
        "{}: {}",
        path.display(),
        failure::wording::in_one_line(error)
    );
    Failure::new(ExitKind::Input, message)
}
