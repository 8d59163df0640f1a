//! Why the shared memory of a deployment cannot be reached, or a topic not be created.

use std::io;
use std::path::PathBuf;

use iceoryx2::node::NodeCreationFailure;
use iceoryx2::service::builder::event::EventCreateError;
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeCreateError;

use crate::room::{ROOM, short_of_room};
use crate::{NamespaceError, PrivacyError};
use failure::Fault;

/// The deployment's shared memory cannot be reached, or a topic not be created.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The working directory cannot be created or written to.
    #[error("cannot use working directory {path:?}")]
    Directory {
        /// The directory or a file below it.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
    /// The deployment belongs to another user.
    #[error(transparent)]
    Privacy(#[from] PrivacyError),
    /// iceoryx2 does not accept the namespace.
    #[error(transparent)]
    Namespace(#[from] NamespaceError),
    /// There is no room for the queues of a process. The system would kill it when it first wrote to them.
    #[error(
        "process {process:?} needs {} KB of shared memory for its queues, {} KB are free in /dev/shm",
        .needed_bytes / 1000, .free_bytes / 1000
    )]
    Full {
        /// Name of the process.
        process: String,
        /// Memory that is needed.
        needed_bytes: u64,
        /// Memory that is free.
        free_bytes: u64,
    },
    /// The process cannot be registered.
    #[error("cannot register process {process:?} below {root:?}")]
    Node {
        /// Name of the process.
        process: String,
        /// Where.
        root: PathBuf,
        /// Why.
        #[source]
        source: NodeCreationFailure,
    },
    /// The topic cannot be created.
    #[error("cannot create topic {topic:?}")]
    Create {
        /// Name of the topic.
        topic: String,
        /// Why.
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
        /// Why.
        source: EventCreateError,
    },
    /// The name of a topic or a process is not one that iceoryx2 accepts.
    #[error("name {name:?} is empty, too long, or not plain text")]
    Name {
        /// The name.
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
