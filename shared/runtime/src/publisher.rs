//! The sending ends of a topic.

use core::marker::PhantomData;
use core::time::Duration;
use std::cell::Cell;
use std::sync::Arc;
use std::time::Instant;

use iceoryx2::port::listener::Listener;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::update_connections::{ConnectionFailure, UpdateConnections as _};
use iceoryx2::port::{BackpressureAction, LoanError as IoxLoanError, SendError as IoxSendError};
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, ipc};

use crate::bus::Bus;
use crate::delivery::Delivery;
use crate::erased::{Chunk, Messages, Types, Writer};
use crate::losses::{Losses, Patience};
use crate::memory;
use crate::onlookers::{self, Onlookers};
use crate::payload::{Element, Header, Message};
use crate::room::{connections, note_room, short_of_room};
use crate::service::{self, PortError};
use crate::{Copies, Progress};
use failure::{ExitKind, Fault, Stop};

/// Longest pause between two checks of a topic's subscribers.
const CONNECT_PAUSE: Duration = Duration::from_millis(20);
/// Pause between two checks for memory that receivers have released.
const CHUNK_PAUSE: Duration = Duration::from_micros(500);

/// Reason why a message could not be delivered.
#[derive(Debug, thiserror::Error)]
pub enum SendError {
    /// There is no memory to write the message into.
    #[error("topic {topic:?} has no memory for another message")]
    Loan {
        /// Name of the topic.
        topic: Arc<str>,
        /// Cause of the error.
        #[source]
        source: IoxLoanError,
    },
    /// The array is longer than the topic allows.
    #[error("topic {topic:?} carries at most {max_len} elements, got {len}")]
    TooLong {
        /// Name of the topic.
        topic: Arc<str>,
        /// Requested length, in elements.
        len: usize,
        /// Maximum length, in elements.
        max_len: usize,
    },
    /// Stop was requested while the sender waited for a slow receiver.
    #[error("stopped while a receiver of topic {topic:?} had no room")]
    Stopped {
        /// Name of the topic.
        topic: Arc<str>,
    },
    /// A receiver had no room for longer than the sender waits.
    #[error("a receiver of topic {topic:?} had no room for {} s", .waited.as_secs())]
    Stuck {
        /// Name of the topic.
        topic: Arc<str>,
        /// Time for which the sender waited.
        waited: Duration,
    },
    /// The publisher cannot connect to a receiver.
    #[error("cannot connect to a receiver of topic {topic:?}")]
    Connection {
        /// Name of the topic.
        topic: Arc<str>,
        /// Cause of the error.
        #[source]
        source: ConnectionFailure,
    },
    /// iceoryx2 failed.
    #[error("cannot send on topic {topic:?}")]
    Transport {
        /// Name of the topic.
        topic: Arc<str>,
        /// Cause of the error.
        #[source]
        source: IoxSendError,
    },
}

impl Fault for SendError {
    fn kind(&self) -> ExitKind {
        if self.is_stopped() {
            ExitKind::Interrupted
        } else {
            ExitKind::Run
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::Connection { .. } | Self::Transport { .. } => short_of_room(),
            _ => None,
        }
    }
}

impl SendError {
    /// Returns true if sending failed only because of a stop request.
    pub fn is_stopped(&self) -> bool {
        matches!(self, Self::Stopped { .. })
    }
}

/// Sends messages, which are copied into shared memory.
#[derive(Debug)]
pub struct Publisher<T: Message> {
    port: Port,
    message: PhantomData<T>,
}

impl<T: Message> Publisher<T> {
    /// Sends a copy and notifies the receivers. With [`Delivery::Lossless`], it waits for room.
    ///
    /// Returns the number of subscribers that received the message.
    ///
    /// # Errors
    ///
    /// Returns a [`SendError`] on failure.
    pub fn send(&self, message: &T) -> Result<usize, SendError> {
        let mut chunk = self.port.chunk(1)?;
        self.port.copies.add(size_of::<T>());
        chunk.write(message);
        self.port.deliver(chunk)
    }

    /// Returns the number of subscribed processes.
    pub fn n_connected(&self) -> usize {
        self.port.n_connected()
    }

    /// Waits for subscribers, see [`SlicePublisher::wait_for_subscribers`].
    pub fn wait_for_subscribers(&self, n: usize, patience: impl Into<Patience>) -> usize {
        self.port.wait_for_subscribers(n, patience.into())
    }
}

/// Sends arrays in place, without copying.
#[derive(Debug)]
pub struct SlicePublisher<E: Element, H: Header> {
    port: Port,
    types: PhantomData<(E, H)>,
}

impl<E: Element, H: Header> SlicePublisher<E, H> {
    /// Loans memory for an array of `len` elements. With [`Delivery::Lossless`], it waits for a receiver to
    /// release memory if necessary.
    ///
    /// The memory contains the values of an earlier message: write every element before sending.
    ///
    /// # Errors
    ///
    /// Returns [`SendError::TooLong`] if the array is too long, and [`SendError::Loan`] if an earlier loan is still held.
    /// Returns [`SendError::Stopped`] or [`SendError::Stuck`] if no memory was released.
    pub fn loan(&self, len: usize) -> Result<Loan<'_, E, H>, SendError> {
        let mut chunk = self.port.chunk_in_time(len)?;
        chunk.write_header::<E, H>();
        Ok(Loan {
            chunk,
            port: &self.port,
            types: PhantomData,
        })
    }

    /// Returns the maximum length of an array, in elements.
    pub fn max_len(&self) -> usize {
        self.port.max_len
    }

    /// Returns the number of subscribed processes.
    pub fn n_connected(&self) -> usize {
        self.port.n_connected()
    }

    /// Waits for `n` subscribers. With [`Delivery::Lossless`], also waits until they have acknowledged this
    /// publisher, because messages that do not fit into their buffers are lost before that.
    ///
    /// Returns the number of subscribers, which is less than `n` if the time limit has passed or stop is requested.
    pub fn wait_for_subscribers(&self, n: usize, patience: impl Into<Patience>) -> usize {
        self.port.wait_for_subscribers(n, patience.into())
    }
}

/// A loan: an array in shared memory that has not been sent yet. Dropping it releases the memory.
#[derive(Debug)]
pub struct Loan<'a, E: Element, H: Header> {
    chunk: Chunk,
    port: &'a Port,
    types: PhantomData<(E, H)>,
}

impl<E: Element, H: Header> Loan<'_, E, H> {
    /// Returns the array, which begins on a multiple of 64 bytes.
    pub fn payload_mut(&mut self) -> &mut [E] {
        self.chunk.payload_mut::<E, H>()
    }

    /// Returns the header, which initially has its default value.
    pub fn header_mut(&mut self) -> &mut H {
        self.chunk.header_mut::<E, H>()
    }

    /// Sends the array and notifies the receivers. With [`Delivery::Lossless`], it waits for room.
    ///
    /// Returns the number of subscribers that received the array.
    ///
    /// # Errors
    ///
    /// Returns [`SendError::Stopped`], [`SendError::Stuck`] or [`SendError::Transport`].
    pub fn send(self) -> Result<usize, SendError> {
        self.port.deliver(self.chunk)
    }
}

#[derive(Debug)]
struct Port {
    topic: Arc<str>,
    max_len: usize,
    delivery: Delivery,
    writer: Writer,
    notifier: Option<Notifier<ipc::Service>>,
    /// The subscribers for which this publisher does not wait.
    onlookers: Onlookers,
    /// Receives the acknowledgements of subscribers.
    ready: Option<Listener<ipc::Service>>,
    n_ready: Cell<usize>,
    messages: Messages,
    stop: Stop,
    progress: Progress,
    copies: Copies,
    /// Time to wait for a slow receiver.
    patience: Duration,
    losses: Losses,
}

impl Bus {
    /// Creates a publisher of a topic of messages.
    ///
    /// # Errors
    ///
    /// Returns a [`PortError`] on failure.
    pub fn publisher<T: Message>(&self, topic: &str) -> Result<Publisher<T>, PortError> {
        Ok(Publisher {
            port: Port::open(self, topic, &Types::new::<T, ()>())?,
            message: PhantomData,
        })
    }

    /// Creates a publisher of a topic of arrays, and reserves all its memory.
    ///
    /// # Errors
    ///
    /// Returns a [`PortError`] on failure.
    pub fn slice_publisher<E: Element, H: Header>(
        &self,
        topic: &str,
    ) -> Result<SlicePublisher<E, H>, PortError> {
        Ok(SlicePublisher {
            port: Port::open(self, topic, &Types::new::<E, H>())?,
            types: PhantomData,
        })
    }
}

impl Port {
    fn open(bus: &Bus, topic: &str, types: &Types) -> Result<Self, PortError> {
        let messages = service::open_messages(bus.node(), topic, types)?;
        let extras = service::extras(&messages);
        // The listener is created first, because subscribers that see the publisher must find it.
        let ready = match extras.delivery {
            Delivery::Realtime => None,
            Delivery::Lossless => Some(bus.listener(&service::ready_name(topic))?),
        };
        let notifier = if extras.wakes {
            Some(bus.notifier(topic)?)
        } else {
            None
        };
        let onlookers = Onlookers::default();
        let publisher = messages
            .publisher_builder()
            .initial_max_slice_len(extras.max_len)
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_samples(extras.loaned)
            .override_sample_preallocation(move |_| extras.chunks)
            .backpressure_strategy(BackpressureStrategy::RetryUntilDelivered)
            .set_backpressure_handler(patience(bus, &onlookers))
            .set_degradation_handler(connections())
            .create()
            .inspect_err(note_room)
            .map_err(|source| match memory::refused(bus.namespace().prefix()) {
                Some(source) => PortError::Memory {
                    topic: topic.to_owned(),
                    source,
                },
                None => PortError::Publisher {
                    topic: topic.to_owned(),
                    source,
                },
            })?;
        let mapped = [extras.mapped, extras.chunks];
        let pool = (bus.namespace().prefix(), publisher.id().value());
        memory::populate(pool, mapped).map_err(|source| PortError::Memory {
            topic: topic.to_owned(),
            source,
        })?;
        Ok(Self {
            topic: Arc::from(topic),
            max_len: extras.max_len,
            delivery: extras.delivery,
            writer: Writer::new(publisher, types),
            notifier,
            onlookers,
            ready,
            n_ready: Cell::new(0),
            messages,
            stop: bus.stop().clone(),
            progress: bus.progress().clone(),
            copies: bus.copies().clone(),
            patience: bus.patience(),
            losses: Losses::of(bus.namespace()),
        })
    }

    fn chunk(&self, len: usize) -> Result<Chunk, SendError> {
        let chunk = self.writer.loan(len);
        chunk.map_err(|source| self.loan_failed(len, source))
    }

    /// Loans a chunk. With lossless delivery, it waits for a receiver to release one.
    fn chunk_in_time(&self, len: usize) -> Result<Chunk, SendError> {
        let begin = Instant::now();
        loop {
            match self.writer.loan(len) {
                Err(IoxLoanError::OutOfMemory) if self.delivery == Delivery::Lossless => {
                    self.wait_for_a_chunk(begin)?;
                }
                chunk => return chunk.map_err(|source| self.loan_failed(len, source)),
            }
        }
    }

    /// Pauses, or fails if the wait has lasted too long.
    fn wait_for_a_chunk(&self, begin: Instant) -> Result<(), SendError> {
        let (topic, waited) = (Arc::clone(&self.topic), begin.elapsed());
        if self.stop.is_requested() {
            return Err(SendError::Stopped { topic });
        }
        if waited >= self.patience {
            return Err(SendError::Stuck { topic, waited });
        }
        self.progress.tick();
        // Updating the connections releases chunks that a dead receiver holds.
        let updated = self.writer.port().update_connections();
        let updated = updated.inspect_err(note_room);
        updated.map_err(|source| SendError::Connection { topic, source })?;
        std::thread::sleep(CHUNK_PAUSE);
        Ok(())
    }

    fn loan_failed(&self, len: usize, source: IoxLoanError) -> SendError {
        let topic = Arc::clone(&self.topic);
        if len > self.max_len {
            return SendError::TooLong {
                topic,
                len,
                max_len: self.max_len,
            };
        }
        SendError::Loan { topic, source }
    }

    fn deliver(&self, chunk: Chunk) -> Result<usize, SendError> {
        if self.delivery == Delivery::Lossless {
            self.onlookers.update(&self.messages);
        }
        let begin = Instant::now();
        let sent = chunk.send();
        if let Some(notifier) = &self.notifier
            && let Err(error) = notifier.notify()
        {
            // Receivers that are not woken check their buffers from time to time.
            tracing::debug!(topic = %self.topic, ?error, "cannot wake the receivers");
        }
        if let Err(error) = &sent {
            note_room(error);
            self.stop.wait_for_unasked_end();
        }
        let topic = || Arc::clone(&self.topic);
        sent.map_err(|source| match source {
            // A signal also interrupts a wait inside iceoryx2, which then reports an internal error.
            _ if self.stop.is_requested() => SendError::Stopped { topic: topic() },
            IoxSendError::UnableToDeliver => SendError::Stuck {
                topic: topic(),
                waited: begin.elapsed(),
            },
            source => SendError::Transport {
                topic: topic(),
                source,
            },
        })
    }

    fn n_connected(&self) -> usize {
        onlookers::n_waited_for(&self.messages)
    }

    fn n_ready(&self) -> usize {
        match (&self.ready, self.delivery) {
            (Some(ready), Delivery::Lossless) => {
                let drained = ready.try_wait(|event| {
                    self.n_ready.set(self.n_ready.get() + event.count as usize);
                });
                if let Err(error) = drained {
                    tracing::debug!(topic = %self.topic, ?error, "cannot receive acknowledgements");
                }
                self.n_ready.get().min(self.n_connected())
            }
            _ => self.n_connected(),
        }
    }

    fn wait_for_subscribers(&self, n: usize, patience: Patience) -> usize {
        let begin = Instant::now();
        loop {
            let ready = self.n_ready();
            let waited = begin.elapsed();
            let is_over = waited >= patience.limit
                || (waited >= patience.after_losses && ready + self.losses.count() >= n);
            if ready >= n || is_over || self.stop.is_requested() {
                return ready;
            }
            self.progress.tick();
            // Wakes the subscribers that already exist, so that they connect.
            if let Some(notifier) = &self.notifier
                && let Err(error) = notifier.notify()
            {
                tracing::debug!(topic = %self.topic, ?error, "cannot wake the receivers");
            }
            std::thread::sleep(CONNECT_PAUSE);
        }
    }
}

/// Limits of a sender's sleep before it checks again whether a receiver has room. Within the limits, it sleeps for a quarter of the
/// time that it has already waited.
const LEAST_PAUSE: Duration = Duration::from_micros(50);
const MOST_PAUSE: Duration = Duration::from_millis(1);

/// Returns what to do if a receiver has no room: wait until the time limit has passed or stop is requested. If the receiver is an onlooker,
/// it misses the message instead.
fn patience(
    bus: &Bus,
    onlookers: &Onlookers,
) -> impl Fn(&iceoryx2::port::BackpressureInfo) -> BackpressureAction + Send + 'static {
    let stop = bus.stop().clone();
    let progress = bus.progress().clone();
    let limit = bus.patience();
    let onlookers = onlookers.clone();
    move |info| {
        if onlookers.contain(info.receiver_port_id) {
            return BackpressureAction::DiscardData;
        }
        progress.tick();
        if stop.is_requested() || info.elapsed_time >= limit {
            return BackpressureAction::DiscardDataAndFail;
        }
        // iceoryx2 itself retries ten thousand times without a pause before it sleeps. This would occupy a core that the receiver may
        // need.
        std::thread::sleep((info.elapsed_time / 4).clamp(LEAST_PAUSE, MOST_PAUSE));
        BackpressureAction::Retry
    }
}
