//! Why a calibration file could not be read or written.

use std::path::PathBuf;

use crate::{Camera, NotARotation, RigError};

/// Why a calibration file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RigFileError {
    /// No file was given.
    #[error("no calibration file was given")]
    NoFiles,
    /// The file could not be read.
    #[error("cannot read {path}", path = .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is too large for a calibration.
    #[error("{path} is too large for a calibration: {bytes} bytes, limit {limit}", path = .path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// The largest size that is read.
        limit: u64,
    },
    /// Neither content nor extension identify the format.
    #[error("{path} is not a calibration file of a known format (Parallax, Pose2Sim or anipose TOML, Qualisys XML, OpenCV YAML, HumanEva .cal, UMPM .ini, Panoptic JSON)", path = .path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// Files of several formats cannot make one rig.
    #[error("{path} is a {format} file, but the first one is a {first} file", path = .path.display())]
    Mixed {
        /// The file that differs.
        path: PathBuf,
        /// Its format.
        format: &'static str,
        /// Format of the first file.
        first: &'static str,
    },
    /// The content is invalid.
    #[error("{path}", path = .path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Fault of its text.
        source: ParseError,
    },
    /// The format cannot describe the rig.
    #[error("cannot write {path}", path = .path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// Part that it cannot describe.
        source: UnwritableRig,
    },
    /// The file could not be written.
    #[error("cannot write {path}", path = .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Fault in the text of a calibration file. Fields are named as in the file.
#[derive(Debug, thiserror::Error)]
pub enum ParseError {
    /// The text is not of its format.
    #[error("not valid {format}")]
    Syntax {
        /// Name of the format.
        format: &'static str,
        /// The error of its parser, with line and column.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A field that must be there is not.
    #[error("{field} is missing")]
    Missing {
        /// The field.
        field: String,
    },
    /// A field of the wrong type or length.
    #[error("{field}: expected {expected}, found {found}")]
    Shape {
        /// The field.
        field: String,
        /// Expected contents.
        expected: &'static str,
        /// Contents found.
        found: String,
    },
    /// A number that is invalid in the format, or not supported.
    #[error("{field} is {value}, but {requirement}")]
    Value {
        /// The field.
        field: String,
        /// The number.
        value: f64,
        /// Requirement on it.
        requirement: &'static str,
    },
    /// Nine numbers that are not a rotation.
    #[error("{field}")]
    Rotation {
        /// The field.
        field: String,
        /// How far they are from one.
        source: NotARotation,
    },
    /// The file has no camera.
    #[error("no camera found: {expected}")]
    NoCameras {
        /// Description of a camera in this format.
        expected: &'static str,
    },
    /// No camera of the file has a place.
    #[error(
        "camera {camera:?}: {why}{}",
        if *.has_lens {
            ": `parallax calibrate board` with `--known` and this file, or `parallax calibrate people`, finds where the cameras stand"
        } else {
            ""
        }
    )]
    NoPlace {
        /// The first of them.
        camera: String,
        /// Why it has none.
        why: &'static str,
        /// True if the file has the lens of a camera.
        has_lens: bool,
    },
    /// The cameras cannot be combined into a rig.
    #[error("the cameras do not form a rig")]
    Rig(#[source] RigError),
}

/// Part of a rig that a format cannot describe.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UnwritableRig {
    /// This format is only read.
    #[error("{format} files can be read, but not written")]
    ReadOnly {
        /// The format.
        format: &'static str,
    },
    /// The format has no such lens model.
    #[error("camera {camera:?}: a {format} file cannot describe its lens ({lens})")]
    Lens {
        /// Name of the camera.
        camera: String,
        /// The format.
        format: &'static str,
        /// The lens, as text.
        lens: String,
    },
    /// The name cannot be used as a file name or a key.
    #[error("camera {camera:?}: the name cannot be written in a {format} file")]
    Name {
        /// Name of the camera.
        camera: String,
        /// The format.
        format: &'static str,
    },
}

/// Refuses names that would leave the folder.
pub(super) fn check_file_name(camera: &Camera) -> Result<(), UnwritableRig> {
    if camera.name.contains(['/', '\\', '\0']) || camera.name.starts_with('.') {
        return Err(UnwritableRig::Name {
            camera: camera.name.clone(),
            format: "one-camera",
        });
    }
    Ok(())
}
