//! Why a deployment cannot be read.

use std::io;

use runfiles::RunningError;
use runtime::{GuestError, NamespaceError, ReceiveError};

/// A deployment cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The name cannot be that of a deployment.
    #[error(transparent)]
    Namespace(#[from] NamespaceError),
    /// It does not run (with the names of those that do), has no place for another client, or sends another version.
    #[error(transparent)]
    Guest(#[from] GuestError),
    /// Its description is missing, damaged, or of another version.
    #[error(transparent)]
    Description(#[from] RunningError),
    /// It has no camera of that name.
    #[error("deployment {deployment:?} has no camera {camera:?}, but {}", .cameras.join(", "))]
    NoCamera {
        /// Name of the deployment.
        deployment: String,
        /// The camera that was asked for.
        camera: String,
        /// The cameras that it has.
        cameras: Vec<String>,
    },
    /// Nothing was asked for.
    #[error("nothing is asked for: neither skeletons nor poses nor pictures")]
    NoWish,
    /// A message cannot be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The thread that reads cannot be started.
    #[error("cannot start the thread that reads the deployment")]
    Thread(#[source] io::Error),
}

impl ClientError {
    /// Returns true if the only reason is that the deployment does not run.
    pub fn is_not_running(&self) -> bool {
        matches!(self, Self::Guest(GuestError::NotRunning { .. }))
    }

    /// Returns a remedy to try, if one is known.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Guest(error) => failure::Fault::hint(error),
            Self::Description(_) => Some(
                "build this program and the deployment of the same version of Parallax".to_owned(),
            ),
            _ => None,
        }
    }
}
