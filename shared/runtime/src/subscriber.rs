//! The receiving ends of a topic.

use core::fmt::Debug;
use core::marker::PhantomData;
use std::cell::RefCell;
use std::sync::Arc;

use iceoryx2::port::ReceiveError as IoxReceiveError;
use iceoryx2::port::notifier::Notifier;
use iceoryx2::port::port_name::PortName;
use iceoryx2::port::update_connections::UpdateConnections as _;
use iceoryx2::prelude::{CallbackProgression, PortFactory as _, ipc};

use crate::bus::Bus;
use crate::delivery::Delivery;
use crate::erased::{Messages, Reader, Received, Types};
use crate::payload::{Element, Header, Message};
use crate::room::{connections, note_room, short_of_room};
use crate::service::{self, PortError};
use crate::{Copies, Waiter};
use failure::Fault;

/// Reason why a message could not be received.
#[derive(Debug, thiserror::Error)]
pub enum ReceiveError {
    /// The process already holds the maximum number of messages of the topic.
    #[error("too many messages of topic {topic:?} are held at the same time")]
    TooManyHeld {
        /// Name of the topic.
        topic: Arc<str>,
    },
    /// iceoryx2 failed.
    #[error("cannot receive from topic {topic:?}")]
    Transport {
        /// Name of the topic.
        topic: Arc<str>,
        /// Cause of the error.
        #[source]
        source: IoxReceiveError,
    },
    /// The message that ends a stream was rejected. It will not be sent again.
    #[error("the end of a stream of {name} is not accepted: {why}")]
    End {
        /// Name of the message type.
        name: &'static str,
        /// Reason for the rejection.
        why: String,
    },
}

impl Fault for ReceiveError {
    fn hint(&self) -> Option<String> {
        match self {
            Self::Transport { .. } => short_of_room(),
            Self::TooManyHeld { .. } | Self::End { .. } => None,
        }
    }
}

/// Receives messages as copies.
#[derive(Debug)]
pub struct Subscriber<T: Message> {
    port: Port,
    message: PhantomData<T>,
}

impl<T: Message> Subscriber<T> {
    /// Takes the oldest waiting message, if there is one.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn receive(&self) -> Result<Option<T>, ReceiveError> {
        self.receive_by(|message| *message)
    }

    /// Takes the oldest waiting message, if there is one, and calls `read` with the message in the memory of its sender. Meant for messages
    /// that are too large for a stack.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn receive_by<R>(&self, read: impl FnOnce(&T) -> R) -> Result<Option<R>, ReceiveError> {
        while let Some(received) = self.port.receive()? {
            if let Some(message) = received.payload::<T, ()>().first() {
                self.port.copies.add(size_of::<T>());
                return Ok(Some(read(message)));
            }
        }
        Ok(None)
    }

    /// Takes all waiting messages and returns the newest.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn latest(&self) -> Result<Option<T>, ReceiveError> {
        let mut latest = None;
        while let Some(message) = self.receive()? {
            latest = Some(message);
        }
        Ok(latest)
    }

    /// Works like [`Self::latest`], for messages that are too large for a stack.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn latest_boxed(&self) -> Result<Option<Box<T>>, ReceiveError> {
        let mut latest = None;
        while let Some(message) = self.receive_by(|message| Box::new(*message))? {
            latest = Some(message);
        }
        Ok(latest)
    }

    /// Returns the ids of the publishers, including those of dead processes until they are cleaned up. A
    /// restarted process has a new id.
    pub fn publishers(&self) -> Vec<u128> {
        self.port.publishers()
    }
}

/// Receives arrays in place, without copying.
#[derive(Debug)]
pub struct SliceSubscriber<E: Element, H: Header> {
    port: Port,
    types: PhantomData<(E, H)>,
}

impl<E: Element, H: Header> SliceSubscriber<E, H> {
    /// Takes the oldest waiting array, if there is one. The array's memory is held until the sample is dropped.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn receive(&self) -> Result<Option<Sample<E, H>>, ReceiveError> {
        let received = self.port.receive()?;
        Ok(received.map(|received| Sample {
            received,
            types: PhantomData,
        }))
    }

    /// Takes all waiting arrays and returns the newest.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn latest(&self) -> Result<Option<Sample<E, H>>, ReceiveError> {
        let mut latest = None;
        loop {
            match self.receive() {
                Ok(Some(sample)) => latest = Some(sample),
                Ok(None) => return Ok(latest),
                // A newer array has arrived since the last check.
                Err(ReceiveError::TooManyHeld { .. }) if latest.is_some() => latest = None,
                Err(error) => return Err(error),
            }
        }
    }

    /// Copies an array, for use after its sender needs the memory again. The copy is counted in [`Bus::copies`].
    pub fn copy_of(&self, sample: &Sample<E, H>) -> Vec<E> {
        self.port.copies.add(size_of_val(sample.payload()));
        sample.payload().to_vec()
    }

    /// Returns the ids of the publishers, including those of dead processes until they are cleaned up. A
    /// restarted process has a new id.
    pub fn publishers(&self) -> Vec<u128> {
        self.port.publishers()
    }
}

/// An array in shared memory. Its sender does not overwrite it while this value is held.
#[derive(Debug)]
pub struct Sample<E: Element, H: Header> {
    received: Received,
    types: PhantomData<(E, H)>,
}

impl<E: Element, H: Header> Sample<E, H> {
    /// Returns the array, which begins on a multiple of 64 bytes.
    pub fn payload(&self) -> &[E] {
        self.received.payload::<E, H>()
    }

    /// Returns the header. Check it against the array before use, because it comes from another process.
    pub fn header(&self) -> &H {
        self.received.header::<E, H>()
    }
}

/// Returns the name of every subscriber that senders do not wait for ([`Bus::as_onlooker`]).
pub(crate) fn onlooker() -> PortName {
    // The name is short and plain, so it is always accepted.
    PortName::new("onlooker").unwrap_or_else(|_| PortName::new_empty())
}

#[derive(Debug)]
struct Port {
    topic: Arc<str>,
    reader: Reader,
    messages: Messages,
    /// Tells publishers that this subscriber is connected. Used only with lossless delivery.
    ready: Option<Notifier<ipc::Service>>,
    known_publishers: RefCell<Vec<u128>>,
    copies: Copies,
}

impl Bus {
    /// Creates a subscriber of a topic of messages. New messages wake `waiter`.
    ///
    /// # Errors
    ///
    /// Returns a [`PortError`] on failure.
    pub fn subscriber<T: Message>(
        &self,
        topic: &str,
        waiter: &mut Waiter,
    ) -> Result<Subscriber<T>, PortError> {
        Ok(Subscriber {
            port: Port::open(self, topic, &Types::new::<T, ()>(), waiter)?,
            message: PhantomData,
        })
    }

    /// Creates a subscriber of a topic of arrays. New arrays wake `waiter`.
    ///
    /// # Errors
    ///
    /// Returns a [`PortError`] on failure.
    pub fn slice_subscriber<E: Element, H: Header>(
        &self,
        topic: &str,
        waiter: &mut Waiter,
    ) -> Result<SliceSubscriber<E, H>, PortError> {
        Ok(SliceSubscriber {
            port: Port::open(self, topic, &Types::new::<E, H>(), waiter)?,
            types: PhantomData,
        })
    }
}

impl Port {
    fn open(bus: &Bus, topic: &str, types: &Types, waiter: &mut Waiter) -> Result<Self, PortError> {
        let messages = service::open_messages(bus.node(), topic, types)?;
        let extras = service::extras(&messages);
        let ready = match extras.delivery {
            Delivery::Lossless if !bus.looks_on() => {
                Some(bus.notifier(&service::ready_name(topic))?)
            }
            Delivery::Realtime | Delivery::Lossless => None,
        };
        if bus.looks_on() {
            // The subscriber polls, because no sender should have to wake it.
        } else if waiter.spins() {
            // A spinning waiter needs no wake-up.
            waiter.poll_without_pause();
        } else if extras.wakes {
            waiter.watch(bus.listener(topic)?);
        }
        let mut builder = messages.subscriber_builder().set_degradation_handler(connections());
        if bus.looks_on() {
            builder = builder.name(&onlooker());
        }
        let subscriber =
            builder
                .create()
                .inspect_err(note_room)
                .map_err(|source| PortError::Subscriber {
                    topic: topic.to_owned(),
                    source,
                })?;
        let port = Self {
            topic: Arc::from(topic),
            reader: Reader::new(subscriber, types),
            messages,
            ready,
            known_publishers: RefCell::new(Vec::new()),
            copies: bus.copies().clone(),
        };
        port.connect()?;
        Ok(port)
    }

    /// Connects to the existing publishers.
    fn connect(&self) -> Result<(), PortError> {
        // The publishers are listed before connecting, so that only connected publishers are acknowledged. A new publisher may appear in
        // the meantime.
        let publishers = self.publishers();
        let connected = self.reader.port().update_connections();
        connected.inspect_err(note_room).map_err(|source| PortError::Connection {
            topic: self.topic.to_string(),
            source,
        })?;
        self.acknowledge(publishers);
        Ok(())
    }

    fn receive(&self) -> Result<Option<Received>, ReceiveError> {
        // The publishers are listed before connecting, as in `connect`.
        let publishers = self.ready.as_ref().map(|_| self.publishers());
        let topic = || Arc::clone(&self.topic);
        let sample =
            self.reader.receive().inspect_err(note_room).map_err(|source| match source {
                IoxReceiveError::ExceedsMaxBorrows => ReceiveError::TooManyHeld { topic: topic() },
                source @ IoxReceiveError::ConnectionFailure(_) => ReceiveError::Transport {
                    topic: topic(),
                    source,
                },
            })?;
        if let Some(publishers) = publishers {
            self.acknowledge(publishers);
        }
        Ok(sample)
    }

    fn publishers(&self) -> Vec<u128> {
        let mut ids = Vec::new();
        self.messages.dynamic_config().list_publishers(|details| {
            ids.push(details.publisher_id.value());
            CallbackProgression::Continue
        });
        ids
    }

    /// Acknowledges every publisher once.
    fn acknowledge(&self, publishers: Vec<u128>) {
        let Some(ready) = &self.ready else { return };
        let mut known = self.known_publishers.borrow_mut();
        let is_new = publishers.iter().any(|id| !known.contains(id));
        if is_new && let Err(error) = ready.notify() {
            tracing::debug!(topic = %self.topic, ?error, "cannot acknowledge a publisher");
        }
        *known = publishers;
    }
}
