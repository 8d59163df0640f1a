//! Exit status of the errors of data sets, sequences, films and networks.

use std::error::Error;
use std::fs;
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

/// Makes a folder for results, with those above it.
pub(crate) fn make_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder).map_err(|error| {
        let message = format!("cannot make the folder {}: {error}", folder.display());
        Failure::new(ExitKind::Input, message)
            .with_hint("results go to the folder `output` of the deployment file, or to --out: name one that can be written")
    })
}

/// What is said of a network that cannot be run.
pub(crate) fn refused(path: &Path, error: &(dyn Error + 'static)) -> Failure {
    let message = format!("{}: {}", path.display(), causes::in_one_line(error));
    Failure::new(ExitKind::Input, message)
}
