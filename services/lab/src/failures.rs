//! Exit status for errors of data sets, sequences, films and networks.

use crate::evaluation::FilmError;
use failure::{ExitKind, Failure};
use training::datasets::DatasetError;
use training::datasets::sequences::SequenceError;

/// Converts the error of a data set. A selection without people is a usage error; all other errors are input errors.
pub fn dataset_failure(error: DatasetError) -> Failure {
    let kind = match error {
        DatasetError::Select(_) => ExitKind::Usage,
        _ => ExitKind::Input,
    };
    Failure::new(kind, error)
}

/// Converts the error of a sequence.
pub fn sequence_failure(error: SequenceError) -> Failure {
    let kind = match &error {
        SequenceError::Rig(geometry::files::RigFileError::Read { .. }) => ExitKind::Input,
        SequenceError::Rig(_) | SequenceError::Cameras { .. } => ExitKind::Calibration,
        _ => ExitKind::Input,
    };
    Failure::new(kind, error)
}

/// Converts the error of frames that cannot be read.
pub(crate) fn film_failure(error: FilmError) -> Failure {
    let kind = match &error {
        FilmError::Footage { .. } => ExitKind::Input,
        FilmError::Framing { .. } | FilmError::Warp { .. } => ExitKind::Calibration,
    };
    Failure::new(kind, error)
}
