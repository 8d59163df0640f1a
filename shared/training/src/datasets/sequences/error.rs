//! Reasons why a sequence could not be read.

use std::path::{Path, PathBuf};

use formats::c3d::C3dError;
use formats::trc::TrcError;
use geometry::RigError;
use geometry::files::RigFileError;

/// Reason why a sequence could not be read.
#[derive(Debug, thiserror::Error)]
pub enum SequenceError {
    /// The path is neither a known data set nor a description.
    #[error(
        "{}: neither a folder of HumanEva-I, UMPM or `parallax-lab synth`, nor a description (.toml)",
        .path.display()
    )]
    Unknown {
        /// The path.
        path: PathBuf,
    },
    /// A file cannot be read.
    #[error("{}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The footage of a camera is missing.
    #[error("{}: {hint}", .path.display())]
    NoFootage {
        /// Path where the footage is expected.
        path: PathBuf,
        /// Advice.
        hint: &'static str,
    },
    /// The calibration cannot be read.
    #[error("cannot read the calibration")]
    Rig(#[from] RigFileError),
    /// The cameras are not a valid rig.
    #[error("{}: invalid cameras", .path.display())]
    Cameras {
        /// The calibration.
        path: PathBuf,
        /// Fault of the rig.
        source: RigError,
    },
    /// The rig lacks a camera.
    #[error("{}: no camera {name:?}", .path.display())]
    NoCamera {
        /// The calibration, or the file that refers to the camera.
        path: PathBuf,
        /// Name of the camera.
        name: String,
    },
    /// A motion capture file cannot be read.
    #[error("{}", .path.display())]
    C3d {
        /// The file.
        path: PathBuf,
        /// Error of the file's content.
        source: C3dError,
    },
    /// A motion capture file lacks a point.
    #[error("{}: no point {name:?}", .path.display())]
    NoPoint {
        /// The file.
        path: PathBuf,
        /// Name of the point.
        name: String,
    },
    /// The unit of a motion capture file is unknown.
    #[error("{}: unit {units:?} is not known", .path.display())]
    Units {
        /// The file.
        path: PathBuf,
        /// The unit in the file.
        units: String,
    },
    /// The file with the true joints cannot be read.
    #[error("{}", .path.display())]
    Trc {
        /// The file.
        path: PathBuf,
        /// Error of the file's content.
        source: TrcError,
    },
    /// A text file is invalid.
    #[error("{}, line {line}: {what}", .path.display())]
    Text {
        /// The file.
        path: PathBuf,
        /// Number of the line, counted from 1; 0 if the error concerns the whole file.
        line: usize,
        /// Fault of the line.
        what: String,
    },
    /// The streams of a trial cannot be synchronised.
    #[error("{}", .path.display())]
    Sync {
        /// Folder of the trial.
        path: PathBuf,
        /// Reason why they cannot be synchronised.
        source: SyncError,
    },
}

/// Reason why the streams of a trial cannot be synchronised.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SyncError {
    /// No camera has an offset.
    #[error("no camera has a start offset (.ofs)")]
    Nothing,
    /// A rate is not positive.
    #[error(
        "there are {rate} frames of motion capture for each frame of a camera, expected more than 0"
    )]
    Rate {
        /// Frames of motion capture per camera frame.
        rate: f64,
    },
    /// The synchronised trial would begin before the first frame of a stream.
    #[error("a camera would begin at frame {offset}, before its first frame, 1")]
    Before {
        /// Number of the frame, from 1.
        offset: f64,
    },
}

/// Reads a text file; an error names the file.
pub(crate) fn text(path: &Path) -> Result<String, SequenceError> {
    files::read_text(path, files::RESULTS).map_err(|source| io(path, source))
}

pub(crate) fn io(path: &Path, source: std::io::Error) -> SequenceError {
    let path = path.to_owned();
    SequenceError::Io { path, source }
}

pub(crate) fn invalid(path: &Path, line: usize, what: impl Into<String>) -> SequenceError {
    SequenceError::Text {
        path: path.to_owned(),
        line,
        what: what.into(),
    }
}

/// Reads a motion capture file, and returns it with the length of its unit in metres.
pub(crate) fn motion(path: &Path) -> Result<(formats::c3d::C3d, f64), SequenceError> {
    let bytes = files::read(path, files::RESULTS).map_err(|source| io(path, source))?;
    let path = path.to_owned();
    let trial = match formats::c3d::C3d::parse(&bytes) {
        Ok(trial) => trial,
        Err(source) => return Err(SequenceError::C3d { path, source }),
    };
    match trial.metres_per_unit() {
        Some(metres) => Ok((trial, metres)),
        None => Err(SequenceError::Units {
            path,
            units: trial.units().to_owned(),
        }),
    }
}
