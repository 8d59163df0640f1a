//! Exit status of the errors of data sets, sequences, films and networks.

use crate::evaluation::FilmError;
use failure::{ExitKind, Failure};
use training::datasets::DatasetError;
use training::datasets::sequences::SequenceError;

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
pub(crate) fn film_failure(error: FilmError) -> Failure {
    let kind = match &error {
        FilmError::Footage { .. } => ExitKind::Input,
        FilmError::Framing { .. } | FilmError::Warp { .. } => ExitKind::Calibration,
    };
    Failure::new(kind, error)
}
