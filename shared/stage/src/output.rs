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

/// Sends the end of a stream: with the stamp of the input's end, if there is one, or of the session.
type SendEnd = dyn Fn(Option<Stamp>, u64) -> Result<(), SendError>;

/// An output of any message type.
pub(crate) struct Outgoing {
    receivers: Rc<dyn Receivers>,
    n_receivers: usize,
    /// Arrays have none.
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

    /// Arrays have no end of stream of their own: they belong to messages that have one.
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

    /// Waits for the receivers; returns how many are connected, and how many are expected.
    pub(crate) fn wait(&self, patience: Patience) -> [usize; 2] {
        let n = self.receivers.wait_for(self.n_receivers, patience);
        [n, self.n_receivers]
    }

    /// How many processes are connected that the end of the stream is for.
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
