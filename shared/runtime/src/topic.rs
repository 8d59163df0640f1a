//! The quality of service of one topic, fixed before any process starts.

use crate::bus::{Bus, BusError, Topic};
use crate::payload::{Element, Header, Message};

/// What happens when a receiver is slower than its sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Delivery {
    /// The sender never waits: a full buffer loses its oldest message, so the latest wins.
    #[default]
    Realtime,
    /// Nothing is lost: a full buffer makes the sender wait.
    Lossless,
}

/// How many ports a topic has and how much each of them may hold.
///
/// Memory is reserved for the worst case, so that a sender never runs out:
/// `subscribers * (buffer + borrowed) + loaned` chunks for each publisher, unless
/// [`TopicPlan::with_few_chunks`] says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Ports that may send at the same time.
    pub publishers: usize,
    /// Ports that may receive at the same time.
    pub subscribers: usize,
    /// Messages that wait for one subscriber.
    pub buffer: usize,
    /// Messages that one subscriber may hold at the same time.
    pub borrowed: usize,
    /// Messages that one publisher may write at the same time.
    pub loaned: usize,
}

impl Limits {
    /// One publisher that writes one message at a time.
    ///
    /// * `buffer`: messages that wait for one subscriber.
    /// * `borrowed`: messages that one subscriber may hold at the same time.
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

/// One topic of a deployment: its name, what travels there, and how.
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
    /// A topic of messages that are copied in and out: [`Bus::publisher`], [`Bus::subscriber`].
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

    /// A topic of arrays with a header, written and read where they lie:
    /// [`Bus::slice_publisher`], [`Bus::slice_subscriber`].
    ///
    /// The array begins on a cache line, because its header's size is a multiple of one.
    ///
    /// * `max_len`: longest array, elements.
    pub fn slices<E: Element, H: Header>(
        topic: String,
        delivery: Delivery,
        limits: Limits,
        max_len: usize,
    ) -> Self {
        // Not by iceoryx2's `payload_alignment`, which would align every element.
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

    /// Leaves out the wake-up: receivers of this topic look at it when they see fit.
    #[must_use]
    pub fn without_wake_up(mut self) -> Self {
        self.wakes = false;
        self
    }

    /// For large arrays: says that so few chunks do, at least 1.
    ///
    /// With [`Delivery::Lossless`] a publisher has no more than these, and
    /// [`SlicePublisher::loan`](crate::SlicePublisher::loan) waits until one is free: any number that
    /// leaves one to write while every receiver holds its own keeps all of them going. With
    /// [`Delivery::Realtime`], where nobody may be made to wait, there are as many as before, but
    /// only these are mapped ahead of use; the others cost a sender no memory unless receivers lag.
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

    /// How many ports, and how much each may hold.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Longest array, elements; 1 for messages.
    pub fn max_len(&self) -> usize {
        self.max_len
    }

    /// Whether senders wake receivers.
    pub fn wakes(&self) -> bool {
        self.wakes
    }

    /// Chunks of one publisher.
    pub(crate) fn chunks(&self) -> usize {
        let limits = self.limits;
        let most = limits.subscribers * (limits.buffer + limits.borrowed) + limits.loaned;
        match self.delivery {
            Delivery::Realtime => most,
            Delivery::Lossless => self.usual_chunks.map_or(most, |it| it.min(most)),
        }
    }

    /// Of these, those that are mapped ahead of use.
    pub(crate) fn mapped_chunks(&self) -> usize {
        let chunks = self.chunks();
        self.usual_chunks.map_or(chunks, |it| it.min(chunks))
    }

    /// Bytes of one message, where it is an array of the longest.
    pub fn message_bytes(&self) -> u64 {
        self.chunk_bytes as u64
    }

    /// Shared memory that all publishers of the topic take together, bytes; the largest number where it is more.
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
/// What iceoryx2 puts before the user header, with its alignment.
const TRANSPORT_HEADER_BYTES: usize = 64;

/// Bytes of one chunk.
fn chunk_bytes(header: usize, payload: usize) -> usize {
    (TRANSPORT_HEADER_BYTES + header + payload).next_multiple_of(CACHE_LINE)
}
