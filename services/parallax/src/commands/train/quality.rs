//! `parallax train quality` and `quality-samples`: the network that predicts the errors of single views.

pub(crate) mod network;
mod observer;
pub(crate) mod samples;
mod scenes;

#[cfg(feature = "train-quality")]
mod teach;
#[cfg(feature = "train-quality")]
mod weights;

use std::fs;
use std::path::Path;

use runtime::{ExitKind, Failure};

/// Writes a file that is complete, or the one before it stays.
fn replace(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".new");
    let beside = Path::new(&beside);
    let written = fs::write(beside, bytes).and_then(|()| fs::rename(beside, path));
    written.map_err(|error| {
        let message = format!("cannot write {}: {error}", path.display());
        Failure::new(ExitKind::Run, message)
    })
}
