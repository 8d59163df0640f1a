//! One topic: its quality of service, fixed before any process starts, and its creation.

use iceoryx2::prelude::{Node, ServiceName, ipc};
use iceoryx2::service::builder::event::EventCreateError;
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeCreateError;

use crate::bus_error::BusError;
use crate::delivery::{Delivery, Limits};
use crate::erased::{Messages, Types};
use crate::payload::{Element, Header, Message};
use crate::service::{Extras, WakeUp, patiently, ready_name};

/// Maximum number of processes that may open one topic. It is larger than the number of processes in a deployment, because dead processes
/// count until they are cleaned up.
const MAX_NODES: usize = 96;
/// Maximum number of ports of one wake-up: the maximum number of views of a process, with spare slots for dead ports.
const MAX_WAKE_UP_PORTS: usize = 64;

/// One topic of a deployment: its name, message type and quality of service.
#[derive(Debug, Clone)]
pub struct TopicPlan {
    topic: String,
    delivery: Delivery,
    limits: Limits,
    max_len: usize,
    chunk_bytes: usize,
    /// Number of chunks after a call of [`Self::with_few_chunks`].
    usual_chunks: Option<usize>,
    wakes: bool,
    types: Types,
}

impl TopicPlan {
    /// Creates the plan of a topic of messages that are copied when sent and received: [`Bus::publisher`](crate::Bus::publisher),
    /// [`Bus::subscriber`](crate::Bus::subscriber).
    pub fn messages<T: Message>(topic: String, delivery: Delivery, limits: Limits) -> Self {
        Self {
            topic,
            delivery,
            limits,
            max_len: 1,
            chunk_bytes: chunk_bytes(0, size_of::<T>()),
            usual_chunks: None,
            wakes: true,
            types: Types::new::<T, ()>(),
        }
    }

    /// Creates the plan of a topic of arrays with a header, which are written and read in place:
    /// [`Bus::slice_publisher`](crate::Bus::slice_publisher), [`Bus::slice_subscriber`](crate::Bus::slice_subscriber).
    ///
    /// The array starts on a cache line, because the size of the header is a multiple of a cache line.
    ///
    /// * `max_len`: maximum length of an array, in elements.
    pub fn slices<E: Element, H: Header>(
        topic: String,
        delivery: Delivery,
        limits: Limits,
        max_len: usize,
    ) -> Self {
        // The header has the alignment, because iceoryx2's `payload_alignment` would align every element.
        const { assert!(align_of::<H>() == CACHE_LINE && size_of::<H>().is_multiple_of(CACHE_LINE)) };
        Self {
            topic,
            delivery,
            limits,
            max_len,
            chunk_bytes: chunk_bytes(size_of::<H>(), size_of::<E>() * max_len),
            usual_chunks: None,
            wakes: true,
            types: Types::new::<E, H>(),
        }
    }

    /// Creates the topic without a wake-up; its receivers poll.
    #[must_use]
    pub fn without_wake_up(mut self) -> Self {
        self.wakes = false;
        self
    }

    /// Limits the number of chunks of a publisher of large arrays, to at least 1.
    ///
    /// With [`Delivery::Lossless`], a publisher has only these chunks, and
    /// [`SlicePublisher::loan`](crate::SlicePublisher::loan) waits until one is free. One more chunk than all
    /// receivers borrow is enough. With [`Delivery::Realtime`], a sender never waits, so the number of chunks does not change.
    /// Only the given number is mapped before use; the other chunks cost no memory unless receivers lag.
    #[must_use]
    pub fn with_few_chunks(mut self, chunks: usize) -> Self {
        self.usual_chunks = Some(chunks.max(1));
        self
    }

    /// Returns the name of the topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// Returns the behaviour when a receiver is slower than its sender.
    pub fn delivery(&self) -> Delivery {
        self.delivery
    }

    /// Returns the number of ports and their buffers.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Returns the maximum length of an array, in elements; 1 for messages.
    pub fn max_len(&self) -> usize {
        self.max_len
    }

    /// Returns true if senders notify receivers.
    pub fn wakes(&self) -> bool {
        self.wakes
    }

    /// Returns the number of chunks of one publisher.
    pub(crate) fn chunks(&self) -> usize {
        let limits = self.limits;
        let most = limits.subscribers * (limits.buffer + limits.borrowed) + limits.loaned;
        let needed = match self.delivery {
            Delivery::Realtime => most,
            Delivery::Lossless => self.usual_chunks.map_or(most, |chunks| chunks.min(most)),
        };
        needed + self.onlooked_chunks()
    }

    /// Returns the number of chunks that onlookers may keep their publisher from reusing.
    fn onlooked_chunks(&self) -> usize {
        self.limits.onlookers * (self.limits.buffer + 1)
    }

    /// Returns the number of chunks that are mapped before use.
    pub(crate) fn mapped_chunks(&self) -> usize {
        let chunks = self.chunks() - self.onlooked_chunks();
        self.usual_chunks.map_or(chunks, |usual_chunk| usual_chunk.min(chunks))
    }

    /// Returns the maximum size of one message, in bytes.
    pub fn message_bytes(&self) -> u64 {
        self.chunk_bytes as u64
    }

    /// Returns the size of the shared memory of all publishers of the topic, in bytes; the maximum value if the size overflows.
    pub fn pool_bytes(&self) -> u64 {
        let chunks = (self.limits.publishers as u64).saturating_mul(self.chunks() as u64);
        chunks.saturating_mul(self.chunk_bytes as u64)
    }

    /// Creates the services of the topic.
    pub(crate) fn create(&self, node: &Node<ipc::Service>) -> Result<Topic, BusError> {
        let messages = create_messages(node, self)?;
        let mut wake_ups = Vec::new();
        for name in wake_up_names(self) {
            wake_ups.push(create_wake_up(node, &name)?);
        }
        Ok(Topic {
            _messages: messages,
            _wake_ups: wake_ups,
        })
    }

    fn extras(&self) -> Extras {
        Extras {
            max_len: self.max_len,
            loaned: self.limits.loaned,
            chunks: self.chunks(),
            mapped: self.mapped_chunks(),
            wakes: self.wakes,
            delivery: self.delivery,
        }
    }
}

/// Handle that keeps a topic alive while no process uses it.
#[derive(Debug)]
pub struct Topic {
    _messages: Messages,
    _wake_ups: Vec<WakeUp>,
}

/// Returns the names of the events of a topic: its wake-up if it has one, and with lossless delivery the acknowledgement of
/// connections.
fn wake_up_names(plan: &TopicPlan) -> Vec<String> {
    let mut names = Vec::new();
    if plan.wakes() {
        names.push(plan.topic().to_owned());
    }
    if plan.delivery() == Delivery::Lossless {
        names.push(ready_name(plan.topic()));
    }
    names
}

fn create_messages(node: &Node<ipc::Service>, plan: &TopicPlan) -> Result<Messages, BusError> {
    let bad_name = || BusError::Name {
        name: plan.topic().to_owned(),
    };
    let name = ServiceName::new(plan.topic()).ok().ok_or_else(bad_name)?;
    let attributes = plan.extras().attributes().ok_or_else(bad_name)?;
    let limits = plan.limits();
    let attempt = || {
        plan.types
            .builder(node, &name)
            .enable_safe_overflow(plan.delivery() == Delivery::Realtime)
            .max_publishers(limits.publishers)
            .max_subscribers(limits.subscribers + limits.onlookers)
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

fn create_wake_up(node: &Node<ipc::Service>, name: &str) -> Result<WakeUp, BusError> {
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

/// Size of a cache line, and of the widest vector register, in bytes.
const CACHE_LINE: usize = 64;
/// Size of iceoryx2's own header before the user header, with its alignment, in bytes.
const TRANSPORT_HEADER_BYTES: usize = 64;

/// Returns the size of one chunk, in bytes.
fn chunk_bytes(header: usize, payload: usize) -> usize {
    (TRANSPORT_HEADER_BYTES + header + payload).next_multiple_of(CACHE_LINE)
}
