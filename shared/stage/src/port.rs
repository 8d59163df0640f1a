//! A topic whose messages are checked as they are received.

use failure::Failure;
use messages::Status;
use runtime::{Message, ReceiveError, Service, Subscriber, Waiter};
use wire::WireError;

use crate::{Context, Stamped};

/// Where messages come from: a subscriber, or a list in tests.
pub trait Receive<M> {
    /// The oldest waiting message.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`].
    fn receive(&self) -> Result<Option<M>, ReceiveError>;

    /// The identifiers of the ports that may send; a restarted sender has a new one.
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

/// The sender of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// A process of one view.
    View(usize),
    /// A fusion worker; pairs are assigned to workers in turn.
    Worker {
        /// Its number.
        worker: usize,
        /// Number of workers.
        n_workers: usize,
    },
    /// The process that sends the result of all views.
    All,
}

impl Sender {
    /// Checks the session, the sender and the times of a message. The end of a worker's stream
    /// names no pair, so its number is not checked.
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

/// The receiving end of a topic. Returns the messages of this session and sender; others are counted and logged.
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
    /// Errors of the transport.
    pub fn open(
        service: &Service,
        waiter: &mut Waiter,
        topic: &str,
        sender: Sender,
    ) -> Result<Self, Failure> {
        Ok(Self::new(service.bus().subscriber(topic, waiter)?, sender))
    }

    /// As [`Self::receive`], for messages that are large for a stack.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`].
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
    /// * `receiver`: where messages come from.
    pub fn new(receiver: R, sender: Sender) -> Self {
        Self { receiver, sender }
    }

    /// The oldest waiting message that is accepted, including the end of the stream.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`].
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

    /// Returns true if the sender, once it is restarted, has forgotten frames that others have received: it answers what
    /// views send. A process of a view is given the frame again, and a fusion worker holds what the others wait for.
    pub(crate) fn forgets(&self) -> bool {
        self.sender == Sender::All
    }

    /// The identifiers of the ports that may send; a restarted sender has a new one.
    pub fn senders<M>(&self) -> Vec<u128>
    where
        R: Receive<M>,
    {
        self.receiver.senders()
    }

    /// Discards all waiting messages, so that no sender waits for room.
    ///
    /// # Errors
    ///
    /// [`ReceiveError`].
    pub fn drain<M>(&self) -> Result<(), ReceiveError>
    where
        R: Receive<M>,
    {
        while self.receiver.receive()?.is_some() {}
        Ok(())
    }
}
