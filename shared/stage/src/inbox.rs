//! The inputs of a stage, joined frame by frame. This module is pure: messages, clock and counters are passed in.

use core::time::Duration;

use crate::join::{Cadence, Joined, Joiner, Last};
use messages::{Cause, Stamp};
use runtime::{Delivery, ReceiveError};

use crate::input::Input;
use crate::joins::{Copier, Joins};
use crate::{Context, Item};

/// Rules for joining frames.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rules {
    pub(crate) delivery: Delivery,
    /// Maximum time for which an input may be silent while others wait for it.
    pub(crate) patience: Duration,
    /// Distance between the used frames, if frames may be skipped. If so, the stage uses a [`Cadence`].
    pub(crate) skips: Option<u64>,
}

/// An optional input. Frames wait for it no longer than `deadline`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Optional {
    pub(crate) slot: usize,
    pub(crate) deadline: Duration,
}

/// Joins the messages of several inputs.
pub(crate) struct Inbox<'a, T> {
    inputs: Vec<Box<dyn Input<T> + 'a>>,
    joins: Joins<T>,
    rules: Rules,
    cadence: Cadence,
}

impl<'a, T> Inbox<'a, T> {
    /// Creates an inbox.
    ///
    /// * `remember`: for each slot, the function that copies a value for use in later frames (up to `max_age`), if such use is allowed.
    pub(crate) fn new(
        inputs: Vec<Box<dyn Input<T> + 'a>>,
        rules: Rules,
        optional: &[Optional],
        remember: Vec<Copier<T>>,
        max_age: Duration,
    ) -> Self {
        let n_slots = remember.len();
        let patience = nanos(rules.patience);
        let mut joiner = match rules.delivery {
            Delivery::Lossless => Joiner::lossless(n_slots, patience),
            Delivery::Realtime => Joiner::new(n_slots, patience),
        };
        if rules.delivery == Delivery::Realtime {
            for input in optional {
                joiner.set_deadline(input.slot, nanos(input.deadline));
            }
        }
        Self {
            inputs,
            joins: Joins {
                joiner,
                last: Last::new(n_slots, nanos(max_age)),
                remember,
                end: None,
            },
            rules,
            cadence: Cadence::default(),
        }
    }

    /// Receives all waiting messages of all inputs.
    pub(crate) fn poll(&mut self, context: &Context<'_>) -> Result<(), ReceiveError> {
        for input in &mut self.inputs {
            input.poll(context, &mut self.joins)?;
        }
        Ok(())
    }

    /// Discards all waiting messages of all inputs.
    pub(crate) fn drain(&self) -> Result<(), ReceiveError> {
        self.inputs.iter().try_for_each(|input| input.drain())
    }

    /// Returns the next complete frame. If frames may be skipped, returns the latest complete frame that the cadence selects.
    pub(crate) fn next(&mut self, context: &Context<'_>) -> Option<Joined<Item<T>>> {
        let now = context.now();
        let Some(step) = self.skip_step() else {
            return self.joins.joiner.next(now);
        };
        let cadence = &self.cadence;
        let joiner = &mut self.joins.joiner;
        let (joined, n_skipped) = joiner.latest(now, |frame| cadence.takes(frame.frame / step));
        context.account().dropped(Cause::Busy, n_skipped);
        joined
    }

    /// Records that a frame was processed.
    pub(crate) fn processed(&mut self, stamp: &Stamp, busy_nanos: u64) {
        if let Some(step) = self.skip_step() {
            let nth = stamp.frame / step;
            self.cadence.processed(nth, stamp.captured_at_nanos, busy_nanos);
        }
    }

    fn skip_step(&self) -> Option<u64> {
        let is_realtime = self.rules.delivery == Delivery::Realtime;
        self.rules.skips.filter(|_| is_realtime).map(|step| step.max(1))
    }

    /// Returns the last messages of every slot.
    pub(crate) fn last(&self) -> &Last<T> {
        &self.joins.last
    }

    /// Returns the number of frames that wait for a message.
    pub(crate) fn n_pending(&self) -> usize {
        self.joins.joiner.n_pending()
    }

    /// Returns true if no more frames will follow.
    pub(crate) fn is_over(&self, now: u64) -> bool {
        self.joins.joiner.is_over(now)
    }

    /// Returns the stamp of the last end of a stream that was received.
    pub(crate) fn end_stamp(&self) -> Option<Stamp> {
        self.joins.end
    }
}

fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
