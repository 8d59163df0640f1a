//! Why a motion could not be read.

use std::path::PathBuf;

use c3d::C3dError;
use evaluation::TrcError;

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
    /// Neither C3D nor TRC by its name.
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
    /// A rate that is none.
    #[error("{}: {rate_hz} frames a second", .path.display())]
    Rate {
        /// The file.
        path: PathBuf,
        /// What it says.
        rate_hz: f64,
    },
    /// A unit that is not known.
    #[error("{}: unit {unit:?} is not known; say it in the marker table: unit = \"mm\"", .path.display())]
    Unit {
        /// The file.
        path: PathBuf,
        /// What it says.
        unit: String,
    },
    /// Frames that are not there.
    #[error("{}: frames {}-{} are not among its frames {}-{}", .path.display(), .asked[0], .asked[1], .has[0], .has[1])]
    Frames {
        /// The file.
        path: PathBuf,
        /// First and last that were asked for.
        asked: [u32; 2],
        /// First and last of the file.
        has: [u32; 2],
    },
    /// A table that is none.
    #[error("{}: {what}", .path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What is wrong.
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
    /// A marker that the table names is not there.
    #[error("{}: no marker {name:?}; it has {}", .path.display(), .markers.join(", "))]
    NoMarker {
        /// The file.
        path: PathBuf,
        /// The marker.
        name: String,
        /// Those that there are.
        markers: Vec<String>,
    },
    /// A joint that the table does not make.
    #[error("{}: the marker table says nothing of {joint:?}", .path.display())]
    NoJoint {
        /// The motion.
        path: PathBuf,
        /// The joint.
        joint: String,
    },
    /// A marker was not seen for too long.
    #[error(
        "{}: marker {marker:?} is missing in frames {}-{} ({seconds:.2} s); gaps are bridged up to {max_gap_s} s",
        .path.display(), .frames[0], .frames[1]
    )]
    Gap {
        /// The file.
        path: PathBuf,
        /// The marker.
        marker: String,
        /// First and last frame without it, as the file counts.
        frames: [u32; 2],
        /// How long that is.
        seconds: f64,
        /// What would do.
        max_gap_s: f64,
    },
    /// No person moves like that.
    #[error("{}: {what}", .path.display())]
    Implausible {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what it may come from.
        what: String,
    },
}
