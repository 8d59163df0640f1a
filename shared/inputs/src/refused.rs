//! Failures of networks.

use std::error::Error;
use std::path::Path;

use failure::{ExitKind, Failure};

/// Returns the failure of a network that cannot be run, with the reason.
pub(crate) fn refused(path: &Path, error: &(dyn Error + 'static)) -> Failure {
    let message = format!(
        "{}: {}",
        path.display(),
        failure::wording::in_one_line(error)
    );
    Failure::new(ExitKind::Input, message)
}
