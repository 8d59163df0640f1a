//! The outputs of a stage.

use core::fmt;
use std::rc::Rc;

use failure::{Failure, now_nanos};
use messages::{Stamp, Timing};
use runtime::metrics::Passage;
use runtime::{Element, Header, Message, Patience, Publisher, SendError, Service, SlicePublisher};

use crate::receivers::Receivers;
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

    /// Sends a message about a frame. Returns the send time, in nanoseconds.
    ///
    /// * `view`: view or pair for the stamp of the message; 0 for a message about all views.
    ///
    /// # Errors
    ///
    /// Returns a [`SendError`] on failure.
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

    /// Works like [`Self::send`], and records the latencies of the frame.
    ///
    /// # Errors
    ///
    /// Returns a [`SendError`] on failure.
    pub fn send_and_account(&self, turn: &Turn, view: usize, message: M) -> Result<(), Failure> {
        let sent_at = self.send(turn, view, message)?;
        self.account(turn, sent_at, turn.waited());
        Ok(())
    }

    /// Records the latencies of a message that has just been sent.
    ///
    /// * `waited`: time that the frame waited in this process, in nanoseconds, if it is not recorded elsewhere.
    pub fn account(&self, turn: &Turn, sent_at: u64, waited: Option<u64>) {
        self.service.health().passed(&Passage {
            waiting: waited,
            computing: sent_at.saturating_sub(turn.received_at()),
            publishing: now_nanos() - sent_at,
            since_capture: Some(sent_at.saturating_sub(turn.stamp().captured_at_nanos)),
        });
    }
}

/// Stamp at the end of a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EndStamp {
    /// A stamp in which only the session is set.
    Session,
    /// The stamp of the end of the input's stream, which contains the number of frames of the view.
    Input,
}

/// Sends the end of a stream. It has the stamp of the end of the input's stream, if there is one; otherwise a stamp with only the session.
type SendEnd = dyn Fn(Option<Stamp>, u64) -> Result<(), SendError>;

/// An output of any message type.
pub(crate) struct Outgoing {
    receivers: Rc<dyn Receivers>,
    n_receivers: usize,
    /// Function that sends the end of the stream; `None` for arrays.
    send_end: Option<Box<SendEnd>>,
}

impl Outgoing {
    pub(crate) fn messages<M: Message + Stamped>(
        publisher: &Rc<Publisher<M>>,
        n_receivers: usize,
        end_stamp: EndStamp,
    ) -> Self {
        let receivers = Rc::clone(publisher);
        let publisher = Rc::clone(publisher);
        let send_end = move |of_input: Option<Stamp>, session: u64| {
            let of_session = Stamp {
                session,
                ..Stamp::default()
            };
            let stamp = match end_stamp {
                EndStamp::Session => of_session,
                EndStamp::Input => of_input.unwrap_or(of_session),
            };
            publisher.send(&M::end(stamp)).map(drop)
        };
        Self {
            receivers,
            n_receivers,
            send_end: Some(Box::new(send_end)),
        }
    }

    /// Creates an output of arrays. It needs no end of stream, because arrays belong to messages whose stream has an end.
    pub(crate) fn arrays<E: Element, H: Header>(
        publisher: &Rc<SlicePublisher<E, H>>,
        n_receivers: usize,
    ) -> Self {
        let receivers = Rc::clone(publisher);
        Self {
            receivers,
            n_receivers,
            send_end: None,
        }
    }

    /// Waits for the receivers. Returns the numbers of connected and of expected receivers.
    pub(crate) fn wait(&self, patience: Patience) -> [usize; 2] {
        let n = self.receivers.wait_for(self.n_receivers, patience);
        [n, self.n_receivers]
    }

    /// Returns the number of connected processes that need the end of the stream.
    pub(crate) fn n_connected(&self) -> usize {
        let send = self.send_end.as_ref();
        send.map_or(0, |_| self.receivers.n_connected())
    }

    /// Sends the end of the stream, if this topic has one.
    pub(crate) fn end(&self, of_input: Option<Stamp>, session: u64) -> Result<(), SendError> {
        let send = self.send_end.as_ref();
        send.map_or(Ok(()), |send| send(of_input, session))
    }
}
