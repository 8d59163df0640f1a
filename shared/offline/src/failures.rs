//! Exit status of the errors of data sets, sequences and films.

use std::error::Error;
use std::fs;
use std::io::ErrorKind;
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

/// Reads a text file, and names it if that fails.
pub(crate) fn text(file: &Path) -> Result<String, Failure> {
    fs::read_to_string(file).map_err(|error| match error.kind() {
        ErrorKind::InvalidData => {
            let message = format!("{} is no text: it is not UTF-8", file.display());
            Failure::new(ExitKind::Input, message)
        }
        _ => in_file(file, &error),
    })
}

/// Makes a folder for results, with those above it.
pub(crate) fn make_folder(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder).map_err(|error| {
        let message = format!("cannot make the folder {}: {error}", folder.display());
        Failure::new(ExitKind::Input, message)
            .with_hint("results go to the folder `output` of the deployment file, or to --out: name one that can be written")
    })
}

/// An input that is wrong: the file, then what is wrong with it.
pub(crate) fn in_file(file: &Path, error: &dyn Error) -> Failure {
    Failure::new(ExitKind::Input, format!("{}: {error}", file.display()))
}
