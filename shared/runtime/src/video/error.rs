//! Errors of video devices.

use std::io;
use std::path::PathBuf;

use failure::{ExitKind, Fault};

/// Why a video device cannot be used. Names the device, and what it offers instead.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// It cannot be opened.
    #[error("cannot open the camera {}", path.display())]
    Open {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A device of another kind.
    #[error("{} is no camera: {why}", path.display())]
    NoCamera {
        /// Which.
        path: PathBuf,
        /// Condition that is missing.
        why: String,
    },
    /// A request failed.
    #[error("the camera {} does not {what}", path.display())]
    Request {
        /// Which.
        path: PathBuf,
        /// Request to the kernel.
        what: &'static str,
        /// Why.
        source: io::Error,
    },
    /// A format, a size or a rate that it does not have.
    #[error("the camera {} has no {what} {wanted}; it offers {offered}", path.display())]
    NotOffered {
        /// Which.
        path: PathBuf,
        /// Format, size or rate.
        what: &'static str,
        /// As asked for.
        wanted: String,
        /// Choices that the device has.
        offered: String,
    },
    /// A control that it does not have.
    #[error("the camera {} has no control {name:?}; it has {offered}", path.display())]
    NoControl {
        /// Which.
        path: PathBuf,
        /// As asked for.
        name: String,
        /// Controls that the device has.
        offered: String,
    },
    /// A value that a control does not take.
    #[error("the control {name:?} of the camera {} takes {expected}, got {value}", path.display())]
    Value {
        /// Which camera.
        path: PathBuf,
        /// Which control.
        name: String,
        /// As asked for.
        value: i64,
        /// Values that the control takes.
        expected: String,
    },
    /// It does not deliver any more.
    #[error("the camera {} is gone", path.display())]
    Gone {
        /// Which.
        path: PathBuf,
        /// Error of the kernel.
        source: io::Error,
    },
}

impl Fault for VideoError {
    fn kind(&self) -> ExitKind {
        match self {
            Self::NotOffered { .. } | Self::NoControl { .. } | Self::Value { .. } => {
                ExitKind::Config
            }
            _ => ExitKind::Input,
        }
    }
}
