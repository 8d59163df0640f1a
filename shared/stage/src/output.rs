//! The outputs of a stage.

use core::fmt;
use core::time::Duration;
use std::rc::Rc;

use messages::{Stamp, Timing};
use metrics::Passage;
use runtime::{
    Element, Failure, Header, Message, Publisher, SendError, Service, SlicePublisher, now_nanos,
};

use crate::{Stamped, Turn};

/// A topic that a stage publishes.
pub struct Output<'a, M: Message> {
    service: &'a Service,
    publisher: Rc<Publisher<M>>,
}

impl<M: Message> fmt::Debug for Output<'_, M> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Output").finish_non_exhaustive()
    }
}

impl<'a, M: Message + Stamped> Output<'a, M> {
    pub(crate) fn new(service: &'a Service, publisher: Rc<Publisher<M>>) -> Self {
        Self { service, publisher }
    }

    /// Sends a message of a frame; returns when, nanoseconds.
    ///
    /// * `view`: of its stamp: the view or the pair; 0 for all views.
    ///
    /// # Errors
    ///
    /// [`SendError`].
    pub fn send(&self, turn: &Turn, view: usize, message: M) -> Result<u64, Failure> {
        let sent_at_nanos = now_nanos();
        let stamp = Stamp {
            view: view as u32,
            ..*turn.stamp()
        };
        let timing = Timing {
            received_at_nanos: turn.received_at(),
            sent_at_nanos,
        };
        self.publisher.send(&message.with(stamp, timing))?;
        self.service.health().sent(stamp.frame);
        Ok(sent_at_nanos)
    }

    /// The same, and notes where the time of the frame went.
    ///
    /// # Errors
    ///
    /// [`SendError`].
    pub fn send_and_account(&self, turn: &Turn, view: usize, message: M) -> Result<(), Failure> {
        let sent_at = self.send(turn, view, message)?;
        self.account(turn, sent_at, turn.waited());
        Ok(())
    }

    /// Notes where the time of a message went that has just been sent.
    ///
    /// * `waited`: how long the frame waited before, if it is not noted otherwise, nanoseconds.
    pub fn account(&self, turn: &Turn, sent_at: u64, waited: Option<u64>) {
        self.service.health().passed(&Passage {
            waiting: waited,
            computing: sent_at.saturating_sub(turn.received_at()),
            publishing: now_nanos() - sent_at,
            since_capture: Some(sent_at.saturating_sub(turn.stamp().captured_at_nanos)),
        });
    }
}

/// Which stamp the end of a stream carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EndStamp {
    /// The session alone.
    Session,
    /// That of the input's end: it tells how many frames the footage of a view had.
    Input,
}

/// An output of any message type, as the stage sees it.
pub(crate) trait Outgoing {
    /// Waits for the receivers; how many there are, and how many are expected.
    fn wait(&self, patience: Duration) -> [usize; 2];
    fn n_connected(&self) -> usize;
    /// Sends the end of the stream, if this topic has one.
    fn end(&self, of_input: Option<Stamp>, session: u64) -> Result<(), SendError>;
}

pub(crate) struct Messages<M: Message> {
    pub(crate) publisher: Rc<Publisher<M>>,
    pub(crate) n_receivers: usize,
    pub(crate) end_stamp: EndStamp,
}

impl<M: Message + Stamped> Outgoing for Messages<M> {
    fn wait(&self, patience: Duration) -> [usize; 2] {
        let n = self
            .publisher
            .wait_for_subscribers(self.n_receivers, patience);
        [n, self.n_receivers]
    }

    fn n_connected(&self) -> usize {
        self.publisher.n_connected()
    }

    fn end(&self, of_input: Option<Stamp>, session: u64) -> Result<(), SendError> {
        let of_session = Stamp {
            session,
            ..Stamp::default()
        };
        let stamp = match self.end_stamp {
            EndStamp::Session => of_session,
            EndStamp::Input => of_input.unwrap_or(of_session),
        };
        self.publisher.send(&M::end(stamp)).map(drop)
    }
}

/// Arrays; their end is sent with the messages that they belong to.
pub(crate) struct Arrays<E: Element, H: Header> {
    pub(crate) publisher: Rc<SlicePublisher<E, H>>,
    pub(crate) n_receivers: usize,
}

impl<E: Element, H: Header> Outgoing for Arrays<E, H> {
    fn wait(&self, patience: Duration) -> [usize; 2] {
        let n = self
            .publisher
            .wait_for_subscribers(self.n_receivers, patience);
        [n, self.n_receivers]
    }

    fn n_connected(&self) -> usize {
        0
    }

    fn end(&self, _: Option<Stamp>, _: u64) -> Result<(), SendError> {
        Ok(())
    }
}
