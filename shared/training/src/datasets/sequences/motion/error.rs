//! Why a motion could not be read.

use std::path::PathBuf;

use formats::c3d::C3dError;
use formats::trc::TrcError;

/// Why a motion could not be read.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    /// A file cannot be read.
    #[error("{}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file name ends in neither `.c3d` nor `.trc`.
    #[error("{}: expected a file whose name ends in .c3d or .trc", .path.display())]
    Kind {
        /// The file.
        path: PathBuf,
    },
    /// Not a C3D file.
    #[error("{}", .path.display())]
    C3d {
        /// The file.
        path: PathBuf,
        /// Why.
        source: C3dError,
    },
    /// Not a TRC file.
    #[error("{}", .path.display())]
    Trc {
        /// The file.
        path: PathBuf,
        /// Why.
        source: TrcError,
    },
    /// A rate out of range.
    #[error("{}: {rate_hz} frames a second", .path.display())]
    Rate {
        /// The file.
        path: PathBuf,
        /// The rate in the file.
        rate_hz: f64,
    },
    /// A unit that is not known.
    #[error("{}: unit {unit:?} is not known; set it in the marker table: unit = \"mm\"", .path.display())]
    Unit {
        /// The file.
        path: PathBuf,
        /// The unit in the file.
        unit: String,
    },
    /// Frames that the file does not have.
    #[error("{}: frames {}-{} are not among its frames {}-{}", .path.display(), .asked[0], .asked[1], .has[0], .has[1])]
    Frames {
        /// The file.
        path: PathBuf,
        /// First and last that were requested.
        asked: [u32; 2],
        /// First and last of the file.
        has: [u32; 2],
    },
    /// An invalid marker table.
    #[error("{}: {what}", .path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The fault.
        what: String,
    },
    /// No preset has markers of these names.
    #[error(
        "{}: its markers are those of no preset ({}); name a marker table; it has {}",
        .path.display(), super::PRESETS.join(", "), .markers.join(", ")
    )]
    NoPreset {
        /// The file.
        path: PathBuf,
        /// Its markers.
        markers: Vec<String>,
    },
    /// A marker of the table is missing.
    #[error("{}: no marker {name:?}; it has {}", .path.display(), .markers.join(", "))]
    NoMarker {
        /// The file.
        path: PathBuf,
        /// The marker.
        name: String,
        /// The existing ones.
        markers: Vec<String>,
    },
    /// A joint that the table does not define.
    #[error("{}: the marker table does not define {joint:?}", .path.display())]
    NoJoint {
        /// The motion.
        path: PathBuf,
        /// The joint.
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
        /// The marker.
        marker: String,
        /// First and last frame without it, numbered as in the file.
        frames: [u32; 2],
        /// Duration of the gap.
        seconds: f64,
        /// The longest gap accepted.
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
