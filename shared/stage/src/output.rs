//! The outputs of a stage.

use core::fmt;
use std::rc::Rc;

use messages::{Stamp, Timing};
use metrics::Passage;
use runtime::{
    Element, Failure, Header, Message, Patience, Publisher, SendError, Service, SlicePublisher,
    now_nanos,
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

    /// Sends a message about a frame; returns the send time, nanoseconds.
    ///
    /// * `view`: for its stamp: the view or the pair; 0 for a message about all views.
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

    /// As [`Self::send`], and records the latencies of the frame.
    ///
    /// # Errors
    ///
    /// [`SendError`].
    pub fn send_and_account(&self, turn: &Turn, view: usize, message: M) -> Result<(), Failure> {
        let sent_at = self.send(turn, view, message)?;
        self.account(turn, sent_at, turn.waited());
        Ok(())
    }

    /// Records the latencies of a message that has just been sent.
    ///
    /// * `waited`: how long the frame waited in this process, if that is not recorded elsewhere, nanoseconds.
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
    /// That of the input's end of stream, which gives the number of frames of the view.
    Input,
}

/// An output of any message type.
pub(crate) trait Outgoing {
    /// Waits for the receivers; returns how many are connected, and how many are expected.
    fn wait(&self, patience: Patience) -> [usize; 2];
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
    fn wait(&self, patience: Patience) -> [usize; 2] {
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

/// Arrays. They have no end of stream of their own: they belong to messages that have one.
pub(crate) struct Arrays<E: Element, H: Header> {
    pub(crate) publisher: Rc<SlicePublisher<E, H>>,
    pub(crate) n_receivers: usize,
}

impl<E: Element, H: Header> Outgoing for Arrays<E, H> {
    fn wait(&self, patience: Patience) -> [usize; 2] {
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
