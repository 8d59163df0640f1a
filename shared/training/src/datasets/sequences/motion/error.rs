//! Reasons why a motion could not be read.

use std::path::PathBuf;

use formats::c3d::C3dError;
use formats::trc::TrcError;

/// Reason why a motion could not be read.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    /// A file cannot be read.
    #[error("{}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file name ends in neither `.c3d` nor `.trc`.
    #[error("{}: expected a file whose name ends in .c3d or .trc", .path.display())]
    Kind {
        /// The file.
        path: PathBuf,
    },
    /// The file is not a C3D file.
    #[error("{}", .path.display())]
    C3d {
        /// The file.
        path: PathBuf,
        /// Error of the file's content.
        source: C3dError,
    },
    /// The file is not a TRC file.
    #[error("{}", .path.display())]
    Trc {
        /// The file.
        path: PathBuf,
        /// Error of the file's content.
        source: TrcError,
    },
    /// The frame rate is out of range.
    #[error("{}: the frame rate is {rate_hz} Hz, expected 1 to 100000 Hz", .path.display())]
    Rate {
        /// The file.
        path: PathBuf,
        /// Frame rate in the file.
        rate_hz: f64,
    },
    /// The unit is unknown.
    #[error("{}: unit {unit:?} is not known; set it in the marker table: unit = \"mm\"", .path.display())]
    Unit {
        /// The file.
        path: PathBuf,
        /// The unit in the file.
        unit: String,
    },
    /// The file does not have the requested frames.
    #[error("{}: frames {}-{} are not among the file's frames {}-{}", .path.display(), .asked[0], .asked[1], .has[0], .has[1])]
    Frames {
        /// The file.
        path: PathBuf,
        /// First and last requested frame.
        asked: [u32; 2],
        /// First and last frame of the file.
        has: [u32; 2],
    },
    /// The marker table is invalid.
    #[error("{}: {what}", .path.display())]
    Table {
        /// Path of the table.
        path: PathBuf,
        /// The fault.
        what: String,
    },
    /// No preset matches the names of the markers.
    #[error(
        "{}: its markers match no preset ({}): give a marker table; the markers are {}",
        .path.display(), super::PRESETS.join(", "), .markers.join(", ")
    )]
    NoPreset {
        /// The file.
        path: PathBuf,
        /// Names of the markers in the file.
        markers: Vec<String>,
    },
    /// A marker of the table is missing.
    #[error("{}: no marker {name:?}; the markers are {}", .path.display(), .markers.join(", "))]
    NoMarker {
        /// The file.
        path: PathBuf,
        /// Name of the missing marker.
        name: String,
        /// Names of the markers in the file.
        markers: Vec<String>,
    },
    /// The marker table does not define a required joint.
    #[error("{}: the marker table does not define {joint:?}", .path.display())]
    NoJoint {
        /// Path of the motion file.
        path: PathBuf,
        /// Name of the joint.
        joint: String,
    },
    /// A marker is missing for too long.
    #[error(
        "{}: marker {marker:?} is missing in frames {}-{} ({seconds:.2} s); gaps are bridged up to {max_gap_s} s",
        .path.display(), .frames[0], .frames[1]
    )]
    Gap {
        /// The file.
        path: PathBuf,
        /// Name of the marker.
        marker: String,
        /// First and last frame without the marker, numbered as in the file.
        frames: [u32; 2],
        /// Duration of the gap, in seconds.
        seconds: f64,
        /// Longest accepted gap, in seconds.
        max_gap_s: f64,
    },
    /// The motion is impossible for a person.
    #[error("{}: {what}", .path.display())]
    Implausible {
        /// The file.
        path: PathBuf,
        /// The fault and a likely cause.
        what: String,
    },
}
