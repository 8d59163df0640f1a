//! Errors of video devices.

use std::io;
use std::path::PathBuf;

use failure::{ExitKind, Fault};

/// Reason why a video device cannot be used. It names the device and the choices that the device offers.
#[derive(Debug, thiserror::Error)]
pub enum VideoError {
    /// The device cannot be opened.
    #[error("cannot open the camera {}", path.display())]
    Open {
        /// Path of the device.
        path: PathBuf,
        /// Cause of the error.
        source: io::Error,
    },
    /// The device is of another kind.
    #[error("{} is not a camera: {why}", path.display())]
    NoCamera {
        /// Path of the device.
        path: PathBuf,
        /// Description of what is wrong.
        why: String,
    },
    /// A request failed.
    #[error("the camera {} does not {what}", path.display())]
    Request {
        /// Path of the device.
        path: PathBuf,
        /// Request to the kernel.
        what: &'static str,
        /// Cause of the error.
        source: io::Error,
    },
    /// The device does not offer the requested format, size or rate.
    #[error("the camera {} has no {what} {wanted}; it offers {offered}", path.display())]
    NotOffered {
        /// Path of the device.
        path: PathBuf,
        /// Kind of the request: format, size or rate.
        what: &'static str,
        /// Requested value.
        wanted: String,
        /// Formats, sizes or rates that the device offers instead.
        offered: String,
    },
    /// The device does not have the requested control.
    #[error("the camera {} has no control {name:?}; it has {offered}", path.display())]
    NoControl {
        /// Path of the device.
        path: PathBuf,
        /// Requested name.
        name: String,
        /// Controls that the device has.
        offered: String,
    },
    /// The control does not accept the value.
    #[error("the control {name:?} of the camera {} takes {expected}, got {value}", path.display())]
    Value {
        /// Path of the device.
        path: PathBuf,
        /// Name of the control.
        name: String,
        /// Requested value.
        value: i64,
        /// Values that the control accepts.
        expected: String,
    },
    /// The device no longer delivers pictures.
    #[error("the camera {} is gone", path.display())]
    Gone {
        /// Path of the device.
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
