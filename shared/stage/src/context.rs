//! Context of a stage in its process: the session, the clock and the counters.

use failure::now_nanos;
use messages::{Cause, Refusal, Stamp, Status};
use runtime::{Health, ReceiveError, Service};
use wire::{Expected, WireError};

use crate::Stamped;

/// The counters of a stage, which its process reports in heartbeats.
pub trait Account {
    /// Counts a message that was received and accepted.
    fn received(&self);
    /// Counts messages or frames that were lost.
    fn dropped(&self, cause: Cause, n: u64);
    /// Counts a rejected message, and logs the reason.
    fn refused(&self, cause: Refusal, topic: &str, error: &WireError);
}

impl Account for Health {
    fn received(&self) {
        Self::received(self, 1);
    }

    fn dropped(&self, cause: Cause, n: u64) {
        Self::dropped(self, cause, n);
    }

    fn refused(&self, cause: Refusal, topic: &str, error: &WireError) {
        self.refuse(cause, topic, error);
    }
}

/// The session, the clock and the counters of a stage. Tests provide their own.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    session: u64,
    now: &'a dyn Fn() -> u64,
    account: &'a dyn Account,
}

impl core::fmt::Debug for Context<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Context")
            .field("session", &self.session)
            .finish_non_exhaustive()
    }
}

impl<'a> Context<'a> {
    /// Creates a context.
    ///
    /// * `now`: returns the time, in nanoseconds of a monotonic clock.
    pub fn new(session: u64, now: &'a dyn Fn() -> u64, account: &'a dyn Account) -> Self {
        Self {
            session,
            now,
            account,
        }
    }

    /// Returns the context of a process.
    pub fn of(service: &'a Service) -> Self {
        Self::new(service.session(), &now_nanos, service.health())
    }

    /// Returns the time of the clock, in nanoseconds.
    pub fn now(&self) -> u64 {
        (self.now)()
    }

    /// Returns the counters.
    pub fn account(&self) -> &'a dyn Account {
        self.account
    }

    /// Returns the expected values of a message.
    ///
    /// * `view`: the view of the topic, or the worker's number for a topic of pairs.
    pub fn expected(&self, view: usize) -> Expected {
        Expected {
            session: self.session,
            view,
            now_nanos: self.now(),
        }
    }

    /// Counts and logs a rejected message that does not end a stream.
    pub fn count_refused(&self, topic: &str, error: &WireError) {
        self.account.refused(error.refusal(), topic, error);
    }

    /// Counts and logs a rejected message.
    ///
    /// # Errors
    ///
    /// Returns [`ReceiveError::End`] if the message is the end of a stream of this session, because the end is sent only once.
    pub fn refuse<M: Stamped>(&self, message: &M, error: &WireError) -> Result<(), ReceiveError> {
        self.refuse_end(M::NAME, message.stamp(), message.status(), error)
    }

    /// Works like [`refuse`](Self::refuse), for the header of bulk data (large arrays).
    ///
    /// # Errors
    ///
    /// Fails in the same cases as [`refuse`](Self::refuse).
    pub fn refuse_end(
        &self,
        name: &'static str,
        stamp: &Stamp,
        status: Status,
        error: &WireError,
    ) -> Result<(), ReceiveError> {
        self.account.refused(error.refusal(), name, error);
        if status == Status::END && stamp.session == self.session {
            let why = error.to_string();
            return Err(ReceiveError::End { name, why });
        }
        Ok(())
    }
}
