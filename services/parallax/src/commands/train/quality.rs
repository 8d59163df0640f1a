//! `parallax train quality` and `quality-samples`: the network that predicts the errors of single views.

pub(crate) mod network;
mod observer;
pub(crate) mod samples;
mod scenes;

#[cfg(feature = "train-quality")]
mod teach;
#[cfg(feature = "train-quality")]
mod weights;

use std::path::Path;

use runtime::{ExitKind, Failure};

/// Writes a file that is complete, or the one before it stays.
fn replace(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    files::replace(path, bytes).map_err(|error| {
        let message = format!("cannot write {}: {error}", path.display());
        Failure::new(ExitKind::Run, message)
    })
}
