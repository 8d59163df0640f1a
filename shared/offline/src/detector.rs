//! Detectors of people from files.

use std::path::{Path, PathBuf};

use keypoints::DetectorCard;
use posenetwork::Detector;
use runtime::{ExitKind, Failure};

use crate::network::Library;

/// Reads a detector and its card, and tries it once.
///
/// * `card`: the file of the card; if not given, the one beside the network with the ending `.toml`.
///
/// # Errors
///
/// A file cannot be read, is no network that can be run, is no card, or the two do not fit.
pub fn open(path: &Path, card: Option<&Path>) -> Result<Detector, Failure> {
    open_with(path, card, &Library::BuiltIn)
}

/// As [`open`], run by a library of choice.
///
/// # Errors
///
/// As for [`open`].
pub fn open_with(path: &Path, card: Option<&Path>, library: &Library) -> Result<Detector, Failure> {
    let session = library.session(path)?;
    let beside = path.with_extension("toml");
    let card: PathBuf = card.map_or(beside, Path::to_path_buf);
    let text = std::fs::read_to_string(&card).map_err(|error| {
        refused(&card, &error).with_hint(
            "a detector has a card: give it with --detector-card, or put it beside the network; configs/detectors holds some",
        )
    })?;
    let card = DetectorCard::parse(&text).map_err(|error| refused(&card, &error))?;
    Detector::new(session, card).map_err(|error| refused(path, &error))
}

fn refused(path: &Path, error: &(dyn std::error::Error + 'static)) -> Failure {
    let message = format!("{}: {}", path.display(), causes::in_one_line(error));
    Failure::new(ExitKind::Input, message)
}
