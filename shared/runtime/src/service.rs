//! Opens the iceoryx2 services of a topic, with retries while another process creates or removes them.

use core::time::Duration;
use std::thread::sleep;
use std::time::Instant;

use iceoryx2::port::listener::ListenerCreateError;
use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::port::update_connections::ConnectionFailure;
use iceoryx2::prelude::{
    AttributeSet, AttributeSpecifier, Node, PortFactory as _, SemanticString as _, ServiceName, ipc,
};
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};
use iceoryx2::service::builder::event::EventOpenError;
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError;
use iceoryx2::service::port_factory::event::PortFactory as EventFactory;

use crate::delivery::Delivery;
use crate::erased::{Messages, Types};
use crate::memory::MemoryError;
use crate::room::{ROOM, note_room, short_of_room};
use failure::Fault;

/// Time to wait for a service that another process is creating or removing.
const IN_FLUX_LIMIT: Duration = Duration::from_secs(5);
const IN_FLUX_PAUSE: Duration = Duration::from_millis(10);

/// Attribute of a service: maximum length of an array, in elements.
const MAX_LEN: &str = "parallax.max-len";
/// Attribute of a service: number of arrays that a publisher may write at the same time.
const LOANED: &str = "parallax.loaned";
/// Attribute of a service: number of chunks of a publisher.
const CHUNKS: &str = "parallax.chunks";
/// Attribute of a service: number of chunks that a publisher maps before use.
const MAPPED: &str = "parallax.mapped";
/// Attribute of a service: 1 if senders wake receivers.
const WAKES: &str = "parallax.wakes";

/// The wake-up of a topic in one process.
pub(crate) type WakeUp = EventFactory<ipc::Service>;

/// Reason why a port of a topic cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// The topic does not exist.
    #[error(
        "topic {topic:?} does not exist; topics are created by the supervisor before it starts processes"
    )]
    NoSuchTopic {
        /// Name of the topic.
        topic: String,
    },
    /// The topic has another message type than the port.
    #[error(
        "topic {topic:?} does not carry {expected}; were the processes built from different versions?"
    )]
    WrongType {
        /// Name of the topic.
        topic: String,
        /// The message type of the port.
        expected: &'static str,
    },
    /// The topic exists but cannot be opened.
    #[error("cannot open topic {topic:?}")]
    Open {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: PublishSubscribeOpenError,
    },
    /// The wake-up of the topic cannot be opened.
    #[error("cannot open wake-up of topic {topic:?}")]
    OpenWakeUp {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: EventOpenError,
    },
    /// The publisher cannot be created.
    #[error("cannot create a publisher of topic {topic:?}")]
    Publisher {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: PublisherCreateError,
    },
    /// The subscriber cannot be created.
    #[error("cannot create a subscriber of topic {topic:?}")]
    Subscriber {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: SubscriberCreateError,
    },
    /// The notifier cannot be created.
    #[error("cannot create a notifier of topic {topic:?}")]
    Notifier {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: NotifierCreateError,
    },
    /// The listener cannot be created.
    #[error("cannot create a listener of topic {topic:?}")]
    Listener {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: ListenerCreateError,
    },
    /// The subscriber cannot connect to a publisher.
    #[error("cannot connect to a sender of topic {topic:?}")]
    Connection {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: ConnectionFailure,
    },
    /// The memory of the publisher cannot be reserved.
    #[error("cannot reserve the memory of topic {topic:?}")]
    Memory {
        /// Name of the topic.
        topic: String,
        /// Cause of the error.
        #[source]
        source: MemoryError,
    },
    /// iceoryx2 does not accept the name of the topic.
    #[error("topic name {topic:?} is empty, too long, or not plain text")]
    Name {
        /// Name of the topic.
        topic: String,
    },
}

impl Fault for PortError {
    fn hint(&self) -> Option<String> {
        let is_known = matches!(self, Self::Memory { .. });
        short_of_room().or_else(|| is_known.then(|| ROOM.to_owned()))
    }
}

/// Returns the name of the event by which subscribers acknowledge a publisher.
pub(crate) fn ready_name(topic: &str) -> String {
    format!("{topic}/ready")
}

pub(crate) fn open_messages(
    node: &Node<ipc::Service>,
    topic: &str,
    types: &Types,
) -> Result<Messages, PortError> {
    let name = service_name(topic)?;
    let attempt = || types.builder(node, &name).open();
    let in_flux = |error: &PublishSubscribeOpenError| {
        use PublishSubscribeOpenError as E;
        matches!(
            error,
            E::ServiceInCorruptedState | E::IsMarkedForDestruction | E::HangsInCreation
        )
    };
    patiently(attempt, in_flux).map_err(|source| match source {
        PublishSubscribeOpenError::DoesNotExist => PortError::NoSuchTopic {
            topic: topic.to_owned(),
        },
        PublishSubscribeOpenError::IncompatibleTypes => PortError::WrongType {
            topic: topic.to_owned(),
            expected: types.name(),
        },
        source => PortError::Open {
            topic: topic.to_owned(),
            source,
        },
    })
}

pub(crate) fn open_wake_up(node: &Node<ipc::Service>, name: &str) -> Result<WakeUp, PortError> {
    let service = service_name(name)?;
    let attempt = || node.service_builder(&service).event().open();
    let in_flux = |error: &EventOpenError| {
        use EventOpenError as E;
        matches!(
            error,
            E::ServiceInCorruptedState | E::IsMarkedForDestruction | E::HangsInCreation
        )
    };
    patiently(attempt, in_flux).map_err(|source| match source {
        EventOpenError::DoesNotExist => PortError::NoSuchTopic {
            topic: name.to_owned(),
        },
        source => PortError::OpenWakeUp {
            topic: name.to_owned(),
            source,
        },
    })
}

/// The parts of a topic's plan that iceoryx2 has no field for.
pub(crate) struct Extras {
    /// Maximum length of an array, in elements.
    pub(crate) max_len: usize,
    /// Number of arrays that a publisher may write at the same time.
    pub(crate) loaned: usize,
    /// Number of chunks of a publisher.
    pub(crate) chunks: usize,
    /// Number of chunks that are mapped before use.
    pub(crate) mapped: usize,
    /// True if senders wake receivers.
    pub(crate) wakes: bool,
    /// Behaviour when a receiver is slower than its sender.
    pub(crate) delivery: Delivery,
}

impl Extras {
    /// Returns the attributes that [`extras`] reads. The delivery is a setting of the service itself.
    pub(crate) fn attributes(&self) -> Option<AttributeSpecifier> {
        let mut attributes = AttributeSpecifier::new();
        for (key, value) in [
            (MAX_LEN, self.max_len),
            (LOANED, self.loaned),
            (CHUNKS, self.chunks),
            (MAPPED, self.mapped),
            (WAKES, usize::from(self.wakes)),
        ] {
            let key = AttributeKey::new(key.as_bytes()).ok()?;
            let value = AttributeValue::new(value.to_string().as_bytes()).ok()?;
            attributes = attributes.define(&key, &value).ok()?;
        }
        Some(attributes)
    }
}

pub(crate) fn extras(messages: &Messages) -> Extras {
    let set = messages.attributes();
    Extras {
        max_len: attribute(set, MAX_LEN).unwrap_or(1),
        loaned: attribute(set, LOANED).unwrap_or(1),
        chunks: attribute(set, CHUNKS).unwrap_or(usize::MAX),
        mapped: attribute(set, MAPPED).unwrap_or(usize::MAX),
        wakes: attribute(set, WAKES) == Some(1),
        delivery: if messages.static_config().has_safe_overflow() {
            Delivery::Realtime
        } else {
            Delivery::Lossless
        },
    }
}

fn attribute(set: &AttributeSet, key: &str) -> Option<usize> {
    let key = AttributeKey::new(key.as_bytes()).ok()?;
    let value = set.key_value(&key, 0)?;
    core::str::from_utf8(value.as_bytes()).ok()?.parse().ok()
}

fn service_name(topic: &str) -> Result<ServiceName, PortError> {
    ServiceName::new(topic).ok().ok_or_else(|| PortError::Name {
        topic: topic.to_owned(),
    })
}

/// Retries an action that fails only because another process is creating, removing or cleaning up the same service.
pub(crate) fn patiently<T, E>(
    mut attempt: impl FnMut() -> Result<T, E>,
    in_flux: impl Fn(&E) -> bool,
) -> Result<T, E> {
    let begin = Instant::now();
    loop {
        match attempt() {
            Err(error) if in_flux(&error) && begin.elapsed() < IN_FLUX_LIMIT => {
                sleep(IN_FLUX_PAUSE);
            }
            result => return result.inspect_err(note_room),
        }
    }
}
