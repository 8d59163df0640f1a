//! Reasons why a deployment cannot be read.

use std::io;

use runfiles::RunningError;
use runtime::{GuestError, NamespaceError, ReceiveError};

/// Reason why a deployment cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The text is not a valid name of a deployment.
    #[error(transparent)]
    Namespace(#[from] NamespaceError),
    /// The deployment is not running, already has the maximum number of clients, or sends another version of the messages. The error names
    /// the running deployments.
    #[error(transparent)]
    Guest(#[from] GuestError),
    /// The description of the deployment is missing, damaged, or of another version.
    #[error(transparent)]
    Description(#[from] RunningError),
    /// The deployment has no camera with the requested name.
    #[error("deployment {deployment:?} has no camera {camera:?}; its cameras are {}", .cameras.join(", "))]
    NoCamera {
        /// Name of the deployment.
        deployment: String,
        /// The requested camera.
        camera: String,
        /// The cameras of the deployment.
        cameras: Vec<String>,
    },
    /// The [`Wish`](crate::Wish) requests nothing.
    #[error("no data are requested: choose skeletons, poses or pictures")]
    NoWish,
    /// A message cannot be received.
    #[error(transparent)]
    Receive(#[from] ReceiveError),
    /// The thread that reads cannot be started.
    #[error("cannot start the thread that reads the deployment")]
    Thread(#[source] io::Error),
}

impl ClientError {
    /// Returns true if the only reason is that the deployment is not running.
    pub fn is_not_running(&self) -> bool {
        matches!(self, Self::Guest(GuestError::NotRunning { .. }))
    }

    /// Returns something that the user can try, if a remedy is known.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Guest(error) => failure::Fault::hint(error),
            Self::Description(_) => Some(
                "build this program and the deployment from the same version of Parallax"
                    .to_owned(),
            ),
            _ => None,
        }
    }
}
