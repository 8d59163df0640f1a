//! Why a sequence could not be read.

use std::path::{Path, PathBuf};

use formats::c3d::C3dError;
use formats::trc::TrcError;
use geometry::RigError;
use geometry::files::RigFileError;

/// Why a sequence could not be read.
#[derive(Debug, thiserror::Error)]
pub enum SequenceError {
    /// Neither a known data set, nor a description.
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
        /// Why.
        source: std::io::Error,
    },
    /// The footage of a camera is missing.
    #[error("{}: {hint}", .path.display())]
    NoFootage {
        /// Where it should be.
        path: PathBuf,
        /// Advice.
        hint: &'static str,
    },
    /// The calibration cannot be read.
    #[error("the calibration")]
    Rig(#[from] RigFileError),
    /// The cameras are not a valid rig.
    #[error("{}: the cameras", .path.display())]
    Cameras {
        /// The calibration.
        path: PathBuf,
        /// Why.
        source: RigError,
    },
    /// The rig lacks a camera.
    #[error("{}: no camera {name:?}", .path.display())]
    NoCamera {
        /// The calibration, or the file that refers to the camera.
        path: PathBuf,
        /// The camera.
        name: String,
    },
    /// Motion capture cannot be read.
    #[error("{}", .path.display())]
    C3d {
        /// The file.
        path: PathBuf,
        /// Why.
        source: C3dError,
    },
    /// A motion capture file lacks a point.
    #[error("{}: no point {name:?}", .path.display())]
    NoPoint {
        /// The file.
        path: PathBuf,
        /// The point.
        name: String,
    },
    /// The unit of motion capture is not known.
    #[error("{}: unit {units:?} is not known", .path.display())]
    Units {
        /// The file.
        path: PathBuf,
        /// The unit in the file.
        units: String,
    },
    /// The reference cannot be read.
    #[error("{}", .path.display())]
    Trc {
        /// The file.
        path: PathBuf,
        /// Why.
        source: TrcError,
    },
    /// A text is invalid.
    #[error("{}, line {line}: {what}", .path.display())]
    Text {
        /// The file.
        path: PathBuf,
        /// Line, from 1; 0 for the whole file.
        line: usize,
        /// Fault of the line.
        what: String,
    },
    /// The streams of a trial cannot be synchronised.
    #[error("{}", .path.display())]
    Sync {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: SyncError,
    },
}

/// Why the streams of a trial cannot be synchronised.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SyncError {
    /// No camera has an offset.
    #[error("no camera says when it began (.ofs)")]
    Nothing,
    /// A rate that is not positive.
    #[error(
        "there are {rate} frames of motion capture for each frame of a camera, expected more than 0"
    )]
    Rate {
        /// The rate.
        rate: f64,
    },
    /// A stream that would begin before its first frame.
    #[error("a camera would begin at its frame {offset}, before its first frame, 1")]
    Before {
        /// The frame, from 1.
        offset: f64,
    },
}

/// Reads a text file; the error names it.
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

/// Reads a motion capture file; also returns metres per unit.
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
