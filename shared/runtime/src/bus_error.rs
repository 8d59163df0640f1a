//! Reasons why the shared memory of a deployment cannot be reached, or a topic cannot be created.

use std::io;
use std::path::PathBuf;

use iceoryx2::node::NodeCreationFailure;
use iceoryx2::service::builder::event::EventCreateError;
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeCreateError;

use crate::room::{ROOM, short_of_room};
use crate::{NamespaceError, PrivacyError};
use failure::Fault;

/// Reason why the deployment's shared memory cannot be reached, or a topic cannot be created.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The working directory cannot be created or written to.
    #[error("cannot use working directory {path:?}")]
    Directory {
        /// The directory or a file below it.
        path: PathBuf,
        /// Cause of the error.
        #[source]
        source: io::Error,
    },
    /// The deployment belongs to another user.
    #[error(transparent)]
    Privacy(#[from] PrivacyError),
    /// iceoryx2 does not accept the namespace.
    #[error(transparent)]
    Namespace(#[from] NamespaceError),
    /// There is no room in memory for the queues of a process. The system would kill the process when it first writes to them.
    #[error(
        "process {process:?} needs {} KB of shared memory for its queues, but only {} KB are free in /dev/shm",
        .needed_bytes / 1000, .free_bytes / 1000
    )]
    Full {
        /// Name of the process.
        process: String,
        /// Size of the memory that is needed, in bytes.
        needed_bytes: u64,
        /// Size of the memory that is free, in bytes.
        free_bytes: u64,
    },
    /// The process cannot be registered.
    #[error("cannot register process {process:?} below {root:?}")]
    Node {
        /// Name of the process.
        process: String,
        /// Directory of the deployment.
        root: PathBuf,
        /// Cause of the error.
        #[source]
        source: NodeCreationFailure,
    },
    /// The topic cannot be created.
    #[error("cannot create topic {topic:?}")]
    Create {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: PublishSubscribeCreateError,
    },
    /// The wake-up of a topic cannot be created.
    #[error(
        "cannot create wake-up of topic {topic:?}: {}",
        failure::wording::spaced(source)
    )]
    CreateWakeUp {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        source: EventCreateError,
    },
    /// iceoryx2 does not accept the name of a topic or a process.
    #[error("name {name:?} is empty, too long, or not plain text")]
    Name {
        /// The rejected name.
        name: String,
    },
}

impl Fault for BusError {
    fn hint(&self) -> Option<String> {
        match self {
            Self::Privacy(error) => error.hint(),
            Self::Full { .. } => Some(ROOM.to_owned()),
            _ => short_of_room(),
        }
    }
}
