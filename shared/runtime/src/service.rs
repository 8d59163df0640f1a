//! Creation and opening of the iceoryx2 services of a topic, with retries while another process does the
//! same.

use core::time::Duration;
use std::thread::sleep;
use std::time::Instant;

use iceoryx2::port::listener::ListenerCreateError;
use iceoryx2::port::notifier::NotifierCreateError;
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::prelude::{
    AttributeSet, AttributeSpecifier, Node, PortFactory as _, SemanticString as _, ServiceName, ipc,
};
use iceoryx2::service::attribute::{AttributeKey, AttributeValue};
use iceoryx2::service::builder::event::{EventCreateError, EventOpenError};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError, PublishSubscribeOpenError,
};
use iceoryx2::service::port_factory::event::PortFactory as EventFactory;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use crate::bus::BusError;
use crate::memory::MemoryError;
use crate::payload::{Header, Message};
use crate::topic::{Delivery, TopicPlan};

/// How long to wait for a service that another process is creating or removing.
const IN_FLUX_LIMIT: Duration = Duration::from_secs(5);
const IN_FLUX_PAUSE: Duration = Duration::from_millis(10);
/// Processes that may open one topic: more than a deployment has, since dead ones count until they are
/// cleaned up.
const MAX_NODES: usize = 96;
/// Ports of one wake-up: as many as a process may have views, with spare slots for dead ones.
const MAX_WAKE_UP_PORTS: usize = 64;

/// Attribute of a service: longest array, elements.
const MAX_LEN: &str = "parallax.max-len";
/// Attribute of a service: arrays that a publisher may write at the same time.
const LOANED: &str = "parallax.loaned";
/// Attribute of a service: chunks of a publisher.
const CHUNKS: &str = "parallax.chunks";
/// Attribute of a service: chunks that a publisher maps ahead of use.
const MAPPED: &str = "parallax.mapped";
/// Attribute of a service: 1 if senders wake receivers.
const WAKES: &str = "parallax.wakes";

/// The services of a topic in one process.
pub(crate) type Messages<E, H> = PortFactory<ipc::Service, [E], H>;
/// The wake-up of a topic in one process.
pub(crate) type WakeUp = EventFactory<ipc::Service>;

/// A port of a topic cannot be created.
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
        /// Why.
        #[source]
        source: PublishSubscribeOpenError,
    },
    /// The wake-up of the topic cannot be opened.
    #[error("cannot open wake-up of topic {topic:?}")]
    OpenWakeUp {
        /// Name of the topic.
        topic: String,
        /// Why.
        #[source]
        source: EventOpenError,
    },
    /// The publisher cannot be created.
    #[error("cannot make a publisher of topic {topic:?}")]
    Publisher {
        /// Name of the topic.
        topic: String,
        /// Why.
        #[source]
        source: PublisherCreateError,
    },
    /// The subscriber cannot be created.
    #[error("cannot make a subscriber of topic {topic:?}")]
    Subscriber {
        /// Name of the topic.
        topic: String,
        /// Why.
        #[source]
        source: SubscriberCreateError,
    },
    /// The notifier cannot be created.
    #[error("cannot make a notifier of topic {topic:?}")]
    Notifier {
        /// Name of the topic.
        topic: String,
        /// Why.
        #[source]
        source: NotifierCreateError,
    },
    /// The listener cannot be created.
    #[error("cannot make a listener of topic {topic:?}")]
    Listener {
        /// Name of the topic.
        topic: String,
        /// Why.
        #[source]
        source: ListenerCreateError,
    },
    /// The memory of the publisher cannot be reserved.
    #[error("cannot reserve the memory of topic {topic:?}")]
    Memory {
        /// Name of the topic.
        topic: String,
        /// Why.
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

/// The events of a topic: its wake-up if it has one, and with lossless delivery the acknowledgement of
/// connections.
pub(crate) fn wake_up_names(plan: &TopicPlan) -> Vec<String> {
    let mut names = Vec::new();
    if plan.wakes() {
        names.push(plan.topic().to_owned());
    }
    if plan.delivery() == Delivery::Lossless {
        names.push(ready_name(plan.topic()));
    }
    names
}

/// The event by which subscribers acknowledge a publisher.
pub(crate) fn ready_name(topic: &str) -> String {
    format!("{topic}/ready")
}

pub(crate) fn create_messages<E: Message, H: Header>(
    node: &Node<ipc::Service>,
    plan: &TopicPlan,
) -> Result<Messages<E, H>, BusError> {
    let bad_name = || BusError::Name {
        name: plan.topic().to_owned(),
    };
    let name = ServiceName::new(plan.topic()).ok().ok_or_else(bad_name)?;
    let attributes = attributes(plan).ok_or_else(bad_name)?;
    let limits = plan.limits();
    let attempt = || {
        node.service_builder(&name)
            .publish_subscribe::<[E]>()
            .user_header::<H>()
            .enable_safe_overflow(plan.delivery() == Delivery::Realtime)
            .max_publishers(limits.publishers)
            .max_subscribers(limits.subscribers)
            .max_nodes(MAX_NODES)
            .subscriber_max_buffer_size(limits.buffer)
            .subscriber_max_borrowed_samples(limits.borrowed)
            .history_size(0)
            .create_with_attributes(&attributes)
    };
    let in_flux = |error: &PublishSubscribeCreateError| {
        use PublishSubscribeCreateError as E;
        matches!(
            error,
            E::ServiceInCorruptedState | E::IsBeingCreatedByAnotherInstance | E::HangsInCreation
        )
    };
    patiently(attempt, in_flux).map_err(|source| BusError::Create {
        topic: plan.topic().to_owned(),
        source,
    })
}

pub(crate) fn create_wake_up(node: &Node<ipc::Service>, name: &str) -> Result<WakeUp, BusError> {
    let service = ServiceName::new(name).ok().ok_or_else(|| BusError::Name {
        name: name.to_owned(),
    })?;
    let attempt = || {
        node.service_builder(&service)
            .event()
            .max_notifiers(MAX_WAKE_UP_PORTS)
            .max_listeners(MAX_WAKE_UP_PORTS)
            .max_nodes(MAX_NODES)
            .event_id_max_value(0)
            .create()
    };
    let in_flux = |error: &EventCreateError| {
        use EventCreateError as E;
        matches!(
            error,
            E::ServiceInCorruptedState | E::IsBeingCreatedByAnotherInstance
        )
    };
    patiently(attempt, in_flux).map_err(|source| BusError::CreateWakeUp {
        topic: name.to_owned(),
        source,
    })
}

pub(crate) fn open_messages<E: Message, H: Header>(
    node: &Node<ipc::Service>,
    topic: &str,
) -> Result<Messages<E, H>, PortError> {
    let name = service_name(topic)?;
    let attempt = || {
        node.service_builder(&name)
            .publish_subscribe::<[E]>()
            .user_header::<H>()
            .open()
    };
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
            expected: core::any::type_name::<(H, [E; 0])>(),
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
    /// Longest array, elements.
    pub(crate) max_len: usize,
    /// Arrays that a publisher may write at the same time.
    pub(crate) loaned: usize,
    /// Chunks of a publisher.
    pub(crate) chunks: usize,
    /// Of these, those that are mapped ahead of use.
    pub(crate) mapped: usize,
    /// Whether senders wake receivers.
    pub(crate) wakes: bool,
    /// What happens when a receiver is slower than its sender.
    pub(crate) delivery: Delivery,
}

pub(crate) fn extras<E: Message, H: Header>(messages: &Messages<E, H>) -> Extras {
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

fn attributes(plan: &TopicPlan) -> Option<AttributeSpecifier> {
    let mut attributes = AttributeSpecifier::new();
    for (key, value) in [
        (MAX_LEN, plan.max_len()),
        (LOANED, plan.limits().loaned),
        (CHUNKS, plan.chunks()),
        (MAPPED, plan.mapped_chunks()),
        (WAKES, usize::from(plan.wakes())),
    ] {
        let key = AttributeKey::new(key.as_bytes()).ok()?;
        let value = AttributeValue::new(value.to_string().as_bytes()).ok()?;
        attributes = attributes.define(&key, &value).ok()?;
    }
    Some(attributes)
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

/// Retries what fails only because another process is creating, removing or cleaning up the same service.
fn patiently<T, E>(
    mut attempt: impl FnMut() -> Result<T, E>,
    in_flux: impl Fn(&E) -> bool,
) -> Result<T, E> {
    let begin = Instant::now();
    loop {
        match attempt() {
            Err(error) if in_flux(&error) && begin.elapsed() < IN_FLUX_LIMIT => {
                sleep(IN_FLUX_PAUSE);
            }
            result => return result,
        }
    }
}
