//! One frame in a stage.

use std::cell::Cell;

use crate::join::Last;
use messages::{Stamp, Timing};

/// A decoded message.
#[derive(Debug, Clone, PartialEq)]
pub struct Item<T> {
    /// Stamp of the message.
    pub stamp: Stamp,
    /// Timing of the message.
    pub timing: Timing,
    /// Decoded content of the message.
    pub value: T,
}

/// The stamp of the messages that a stage sends for one frame, and the times from which latencies are computed.
#[derive(Debug)]
pub struct Turn {
    stamp: Stamp,
    received_at: Cell<u64>,
    /// Time at which the last input message of the frame was sent.
    last_sent_at: Option<u64>,
}

impl Turn {
    pub(crate) fn new(stamp: Stamp, received_at: u64, last_sent_at: Option<u64>) -> Self {
        Self {
            stamp,
            received_at: Cell::new(received_at),
            last_sent_at,
        }
    }

    /// Returns the stamp of the messages to send. [`crate::Output::send`] sets the view.
    pub fn stamp(&self) -> &Stamp {
        &self.stamp
    }

    /// Returns the time at which work on the next message began, in nanoseconds.
    pub fn received_at(&self) -> u64 {
        self.received_at.get()
    }

    /// Records that work on the next message begins; a stage may send several messages for a frame.
    pub fn restart(&self, now: u64) {
        self.received_at.set(now);
    }

    /// Returns the time that the frame waited in this process, in nanoseconds.
    pub fn waited(&self) -> Option<u64> {
        let sent_at = self.last_sent_at?;
        Some(self.received_at.get().saturating_sub(sent_at))
    }
}

/// The decoded messages of one frame, by slot.
#[derive(Debug)]
pub struct Frame<'a, T> {
    pub(crate) number: u64,
    pub(crate) turn: Turn,
    pub(crate) items: Vec<Option<Item<T>>>,
    pub(crate) last: &'a Last<T>,
}

impl<T> Frame<'_, T> {
    /// Returns the number of the frame.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// Returns the stamp and the times for the messages to send.
    pub fn turn(&self) -> &Turn {
        &self.turn
    }

    /// Returns the message of a slot, if it was received in time.
    pub fn item(&self, slot: usize) -> Option<&Item<T>> {
        self.items.get(slot)?.as_ref()
    }

    /// Takes the message of a slot out of the frame, if it was received in time.
    pub fn take(&mut self, slot: usize) -> Option<Item<T>> {
        self.items.get_mut(slot)?.take()
    }

    /// Returns the message of an optional input, with its age in frames. If there is no message for this frame, returns the last message of
    /// the input, unless it is too old.
    ///
    /// * `captured_at`: capture time of the view's frame, in nanoseconds.
    pub fn latest(&self, slot: usize, captured_at: u64) -> Option<(u64, &T)> {
        match self.item(slot) {
            Some(item) => Some((0, &item.value)),
            None => self.last.of(slot, self.number, captured_at),
        }
    }
}
