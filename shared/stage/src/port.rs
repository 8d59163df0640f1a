//! A topic whose messages are checked as they are received.

use failure::Failure;
use messages::Status;
use runtime::{Message, ReceiveError, Service, Subscriber, Waiter};
use wire::WireError;

use crate::{Context, Stamped};

/// Source of messages: a subscriber, or a list in tests.
pub trait Receive<M> {
    /// Returns the oldest waiting message.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    fn receive(&self) -> Result<Option<M>, ReceiveError>;

    /// Returns the identifiers of the ports that may send. A restarted sender has a new identifier.
    fn senders(&self) -> Vec<u128>;
}

impl<M: Message> Receive<M> for Subscriber<M> {
    fn receive(&self) -> Result<Option<M>, ReceiveError> {
        Self::receive(self)
    }

    fn senders(&self) -> Vec<u128> {
        self.publishers()
    }
}

/// The process that sends on a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// A process of one view.
    View(usize),
    /// A fusion worker. Pairs are assigned to workers in turn.
    Worker {
        /// Number of the worker.
        worker: usize,
        /// Number of workers.
        n_workers: usize,
    },
    /// The process that sends the result of all views.
    All,
}

impl Sender {
    /// Checks the session, the sender and the times of a message. The end of a worker's stream does not belong to a pair, so its pair
    /// number is not checked.
    pub(crate) fn check<M: Stamped>(
        self,
        message: &M,
        context: &Context<'_>,
    ) -> Result<(), WireError> {
        let (stamp, timing) = (message.stamp(), message.timing());
        match self {
            Self::View(view) => context.expected(view).check(stamp, timing),
            Self::All => context.expected(0).check(stamp, timing),
            Self::Worker { worker, .. } if message.status() == Status::END => {
                context.expected(worker).check_end(stamp, timing)
            }
            Self::Worker { worker, n_workers } => {
                let expected = context.expected(worker);
                expected.check_pair(stamp, timing, n_workers)
            }
        }
    }
}

/// The receiving end of a topic. Returns the messages of this session and of the right sender. Other messages are counted and logged.
#[derive(Debug)]
pub struct Port<R> {
    receiver: R,
    sender: Sender,
}

impl<M: Message + Stamped> Port<Subscriber<M>> {
    /// Subscribes to a topic.
    ///
    /// # Errors
    ///
    /// Returns errors of the transport.
    pub fn open(
        service: &Service,
        waiter: &mut Waiter,
        topic: &str,
        sender: Sender,
    ) -> Result<Self, Failure> {
        Ok(Self::new(service.bus().subscriber(topic, waiter)?, sender))
    }

    /// Works like [`Self::receive`], for messages that are too large for a stack.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn receive_boxed(&self, context: &Context<'_>) -> Result<Option<Box<M>>, ReceiveError> {
        while let Some(message) = self.receiver.receive_by(|message| Box::new(*message))? {
            match self.sender.check(&*message, context) {
                Ok(()) => return Ok(Some(message)),
                Err(error) => context.refuse(&*message, &error)?,
            }
        }
        Ok(None)
    }
}

impl<R> Port<R> {
    /// Creates a port.
    ///
    /// * `receiver`: source of the messages.
    pub fn new(receiver: R, sender: Sender) -> Self {
        Self { receiver, sender }
    }

    /// Returns the oldest waiting message that is accepted, including the end of the stream.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn receive<M: Stamped>(&self, context: &Context<'_>) -> Result<Option<M>, ReceiveError>
    where
        R: Receive<M>,
    {
        while let Some(message) = self.receiver.receive()? {
            match self.sender.check(&message, context) {
                Ok(()) => return Ok(Some(message)),
                Err(error) => context.refuse(&message, &error)?,
            }
        }
        Ok(None)
    }

    /// Returns true if the sender, after a restart, no longer has frames that its receivers are waiting for. This is the case for a sender
    /// that computes from messages of views. By contrast, a process of one view receives the frame again, and a fusion worker still holds
    /// the messages for which others wait.
    pub(crate) fn forgets(&self) -> bool {
        self.sender == Sender::All
    }

    /// Returns the identifiers of the ports that may send. A restarted sender has a new identifier.
    pub fn senders<M>(&self) -> Vec<u128>
    where
        R: Receive<M>,
    {
        self.receiver.senders()
    }

    /// Discards all waiting messages, so that no sender has to wait for room.
    ///
    /// # Errors
    ///
    /// Returns a [`ReceiveError`] on failure.
    pub fn drain<M>(&self) -> Result<(), ReceiveError>
    where
        R: Receive<M>,
    {
        while self.receiver.receive()?.is_some() {}
        Ok(())
    }
}
