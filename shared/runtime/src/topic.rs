//! The quality of service of one topic, fixed before any process starts.

use crate::bus::{Bus, BusError, Topic};
use crate::payload::{Element, Header, Message};

/// What happens when a receiver is slower than its sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Delivery {
    /// The sender never waits: a full buffer drops its oldest message, so the latest frame wins.
    #[default]
    Realtime,
    /// Nothing is lost: a full buffer makes the sender wait.
    Lossless,
}

/// The number of ports of a topic and their buffers.
///
/// Memory is reserved for the worst case, so that a sender always has some:
/// `subscribers * (buffer + borrowed) + loaned` chunks for each publisher, unless
/// [`TopicPlan::with_few_chunks`] is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Largest number of publishers.
    pub publishers: usize,
    /// Largest number of subscribers.
    pub subscribers: usize,
    /// Queue length of a subscriber, messages.
    pub buffer: usize,
    /// Messages that one subscriber may borrow at the same time.
    pub borrowed: usize,
    /// Messages that one publisher may have on loan at the same time.
    pub loaned: usize,
}

impl Limits {
    /// One publisher that writes one message at a time.
    ///
    /// * `buffer`: queue length of a subscriber, messages.
    /// * `borrowed`: messages that one subscriber may borrow at the same time.
    pub fn new(subscribers: usize, buffer: usize, borrowed: usize) -> Self {
        Self {
            publishers: 1,
            subscribers,
            buffer,
            borrowed,
            loaned: 1,
        }
    }
}

/// One topic of a deployment: its name, message type and quality of service.
#[derive(Debug, Clone)]
pub struct TopicPlan {
    topic: String,
    delivery: Delivery,
    limits: Limits,
    max_len: usize,
    chunk_bytes: usize,
    /// See [`Self::with_few_chunks`].
    usual_chunks: Option<usize>,
    wakes: bool,
    create: fn(&Bus, &Self) -> Result<Topic, BusError>,
}

impl TopicPlan {
    /// A topic of messages that are copied when sent and received: [`Bus::publisher`], [`Bus::subscriber`].
    pub fn messages<T: Message>(topic: String, delivery: Delivery, limits: Limits) -> Self {
        Self {
            topic,
            delivery,
            limits,
            max_len: 1,
            chunk_bytes: chunk_bytes(0, size_of::<T>()),
            usual_chunks: None,
            wakes: true,
            create: Bus::create_topic::<T, ()>,
        }
    }

    /// A topic of arrays with a header, written and read in place: [`Bus::slice_publisher`],
    /// [`Bus::slice_subscriber`].
    ///
    /// The array starts on a cache line, because its header's size is a multiple of one.
    ///
    /// * `max_len`: longest array, elements.
    pub fn slices<E: Element, H: Header>(
        topic: String,
        delivery: Delivery,
        limits: Limits,
        max_len: usize,
    ) -> Self {
        // iceoryx2's `payload_alignment` would align every element.
        const { assert!(align_of::<H>() == CACHE_LINE && size_of::<H>().is_multiple_of(CACHE_LINE)) };
        Self {
            topic,
            delivery,
            limits,
            max_len,
            chunk_bytes: chunk_bytes(size_of::<H>(), size_of::<E>() * max_len),
            usual_chunks: None,
            wakes: true,
            create: Bus::create_topic::<E, H>,
        }
    }

    /// Leaves out the wake-up: receivers of this topic poll it.
    #[must_use]
    pub fn without_wake_up(mut self) -> Self {
        self.wakes = false;
        self
    }

    /// Limits the chunks of a publisher of large arrays, at least 1.
    ///
    /// With [`Delivery::Lossless`] a publisher has only these, and
    /// [`SlicePublisher::loan`](crate::SlicePublisher::loan) waits until one is free: one more than all
    /// receivers borrow is enough. With [`Delivery::Realtime`], where a sender never waits, there are as many
    /// as before, but only these are mapped ahead of use; the others cost no memory unless receivers lag.
    #[must_use]
    pub fn with_few_chunks(mut self, chunks: usize) -> Self {
        self.usual_chunks = Some(chunks.max(1));
        self
    }

    /// The name of the topic.
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// What happens when a receiver is slower than its sender.
    pub fn delivery(&self) -> Delivery {
        self.delivery
    }

    /// The number of ports and their buffers.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Longest array, elements; 1 for messages.
    pub fn max_len(&self) -> usize {
        self.max_len
    }

    /// Whether senders notify receivers.
    pub fn wakes(&self) -> bool {
        self.wakes
    }

    /// Chunks of one publisher.
    pub(crate) fn chunks(&self) -> usize {
        let limits = self.limits;
        let most = limits.subscribers * (limits.buffer + limits.borrowed) + limits.loaned;
        match self.delivery {
            Delivery::Realtime => most,
            Delivery::Lossless => self.usual_chunks.map_or(most, |chunks| chunks.min(most)),
        }
    }

    /// Of these, those that are mapped ahead of use.
    pub(crate) fn mapped_chunks(&self) -> usize {
        let chunks = self.chunks();
        self.usual_chunks.map_or(chunks, |it| it.min(chunks))
    }

    /// Largest size of one message, bytes.
    pub fn message_bytes(&self) -> u64 {
        self.chunk_bytes as u64
    }

    /// Shared memory of all publishers of the topic together, bytes; saturates.
    pub fn pool_bytes(&self) -> u64 {
        let chunks = (self.limits.publishers as u64).saturating_mul(self.chunks() as u64);
        chunks.saturating_mul(self.chunk_bytes as u64)
    }

    /// Creates the services of the topic.
    pub(crate) fn create(&self, bus: &Bus) -> Result<Topic, BusError> {
        (self.create)(bus, self)
    }
}

/// Bytes of a cache line, and of the widest vector register.
const CACHE_LINE: usize = 64;
/// The header of iceoryx2 before the user header, with its alignment.
const TRANSPORT_HEADER_BYTES: usize = 64;

/// Bytes of one chunk.
fn chunk_bytes(header: usize, payload: usize) -> usize {
    (TRANSPORT_HEADER_BYTES + header + payload).next_multiple_of(CACHE_LINE)
}
