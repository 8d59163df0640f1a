//! Errors of reading or writing calibration files.

use std::path::PathBuf;

use crate::{Camera, NotARotation, RigError};

/// Reason why a calibration file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum RigFileError {
    /// No file was given.
    #[error("no calibration file was given")]
    NoFiles,
    /// The file could not be read.
    #[error("cannot read {path}", path = .path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Cause of the failure.
        source: std::io::Error,
    },
    /// The file is too large for a calibration.
    #[error("{path} is too large for a calibration: the file has {bytes} bytes, but the limit is {limit} bytes", path = .path.display())]
    TooLarge {
        /// Path of the file.
        path: PathBuf,
        /// Size of the file.
        bytes: u64,
        /// Maximum size of a file.
        limit: u64,
    },
    /// Neither the content nor the extension identifies the format.
    #[error("{path} is not a calibration file of a known format (Parallax, Pose2Sim or anipose TOML, Qualisys XML, OpenCV YAML, HumanEva .cal, UMPM .ini, Panoptic JSON)", path = .path.display())]
    UnknownFormat {
        /// Path of the file.
        path: PathBuf,
    },
    /// The files have different formats, so that they cannot form one rig.
    #[error("{path} is a {format} file, but the first file is a {first} file", path = .path.display())]
    Mixed {
        /// Path of the file with the different format.
        path: PathBuf,
        /// Format of this file.
        format: &'static str,
        /// Format of the first file.
        first: &'static str,
    },
    /// The content is invalid.
    #[error("{path}", path = .path.display())]
    Parse {
        /// Path of the file.
        path: PathBuf,
        /// Fault in the text of the file.
        source: ParseError,
    },
    /// The format cannot describe the rig.
    #[error("cannot write {path}", path = .path.display())]
    Unwritable {
        /// Path of the file.
        path: PathBuf,
        /// Part of the rig that the format cannot describe.
        source: UnwritableRig,
    },
    /// The file could not be written.
    #[error("cannot write {path}", path = .path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Cause of the failure.
        source: std::io::Error,
    },
}

/// Fault in the text of a calibration file. Fields are named as in the file.
#[derive(Debug, thiserror::Error)]
pub enum ParseError {
    /// The text does not have the syntax of its format.
    #[error("the text is not valid {format}")]
    Syntax {
        /// Name of the format.
        format: &'static str,
        /// Error of the parser, with line and column.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A required field is missing.
    #[error("{field} is missing")]
    Missing {
        /// Name of the field.
        field: String,
    },
    /// A field has the wrong type or length.
    #[error("{field}: expected {expected}, found {found}")]
    Shape {
        /// Name of the field.
        field: String,
        /// Expected content.
        expected: &'static str,
        /// Content that was found.
        found: String,
    },
    /// A number is invalid in the format, or not supported.
    #[error("{field} is {value}, but {requirement}")]
    Value {
        /// Name of the field.
        field: String,
        /// Value of the field.
        value: f64,
        /// Requirement on the value.
        requirement: &'static str,
    },
    /// Nine numbers do not form a rotation matrix.
    #[error("{field}")]
    Rotation {
        /// Name of the field.
        field: String,
        /// Deviation from a rotation.
        source: NotARotation,
    },
    /// The file has no camera.
    #[error("the file has no camera: {expected}")]
    NoCameras {
        /// Description of a camera in this format.
        expected: &'static str,
    },
    /// No camera of the file has a pose.
    #[error(
        "camera {camera:?}: {why}{}",
        if *.has_lens {
            ": to find the poses of the cameras, use `parallax calibrate people`, or `parallax calibrate board` with `--known` and this \
             file"
        } else {
            ""
        }
    )]
    NoPlace {
        /// Name of the first camera.
        camera: String,
        /// Reason why it has no pose.
        why: &'static str,
        /// True if the file has a lens for any camera.
        has_lens: bool,
    },
    /// The cameras cannot be combined into a rig.
    #[error("the cameras do not form a valid rig")]
    Rig(#[source] RigError),
}

/// Part of a rig that a format cannot describe.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum UnwritableRig {
    /// The format can only be read.
    #[error("{format} files can be read, but not written")]
    ReadOnly {
        /// Name of the format.
        format: &'static str,
    },
    /// The format has no such lens model.
    #[error("camera {camera:?}: a {format} file cannot describe its lens ({lens})")]
    Lens {
        /// Name of the camera.
        camera: String,
        /// Name of the format.
        format: &'static str,
        /// Description of the lens.
        lens: String,
    },
    /// The name of a camera cannot be used as a file name or a key.
    #[error("camera {camera:?}: the name cannot be written in a {format} file")]
    Name {
        /// Name of the camera.
        camera: String,
        /// Name of the format.
        format: &'static str,
    },
}

/// Returns an error for camera names that would refer to a file outside the folder.
pub(super) fn check_file_name(camera: &Camera) -> Result<(), UnwritableRig> {
    if camera.name.contains(['/', '\\', '\0']) || camera.name.starts_with('.') {
        return Err(UnwritableRig::Name {
            camera: camera.name.clone(),
            format: "one-camera",
        });
    }
    Ok(())
}
