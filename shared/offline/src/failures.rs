//! Exit status of the errors of data sets, sequences and films.

use std::error::Error;
use std::path::Path;

use datasets::DatasetError;
use experiment::FilmError;
use runtime::{ExitKind, Failure};
use sequences::SequenceError;

/// A data set that cannot be read. A selection without people is a mistake on the command line, all else is one of
/// the data set.
pub fn dataset_failure(error: DatasetError) -> Failure {
    let kind = match error {
        DatasetError::Select(_) => ExitKind::Usage,
        _ => ExitKind::Input,
    };
    Failure::new(kind, error)
}

/// A sequence that cannot be read.
pub fn sequence_failure(error: SequenceError) -> Failure {
    let kind = match &error {
        SequenceError::Rig(geometry::files::RigFileError::Read { .. }) => ExitKind::Input,
        SequenceError::Rig(_) | SequenceError::Cameras { .. } => ExitKind::Calibration,
        _ => ExitKind::Input,
    };
    Failure::new(kind, error)
}

/// Frames of a sequence that cannot be read.
pub fn film_failure(error: FilmError) -> Failure {
    let kind = match &error {
        FilmError::Footage { .. } => ExitKind::Input,
        FilmError::Framing { .. } | FilmError::Warp { .. } => ExitKind::Calibration,
    };
    Failure::new(kind, error)
}

/// An input that is wrong: the file, then what is wrong with it.
pub(crate) fn in_file(file: &Path, error: &dyn Error) -> Failure {
    Failure::new(ExitKind::Input, format!("{}: {error}", file.display()))
}
