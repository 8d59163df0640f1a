//! The joiner of a stage, and the last messages of each input.

use crate::join::{Joiner, Last, Push};
use messages::{Cause, Stamp, Status};

use crate::slots::Slots;
use crate::{Context, Item};

/// Function that copies a value of a slot for use in later frames; `None` if this is not allowed.
pub(crate) type Copier<T> = Option<fn(&T) -> T>;

/// The joiner, and the last messages of each slot.
pub(crate) struct Joins<T> {
    pub(crate) joiner: Joiner<Item<T>>,
    pub(crate) last: Last<T>,
    /// For each slot, the function that copies a value into `last`.
    pub(crate) remember: Vec<Copier<T>>,
    pub(crate) end: Option<Stamp>,
}

impl<T> Joins<T> {
    pub(crate) fn alive(&mut self, slot: usize, now: u64) {
        self.joiner.alive(slot, now);
    }

    pub(crate) fn restarted(&mut self, slot: usize, now: u64) {
        self.joiner.restarted(slot, now);
    }

    pub(crate) fn end(&mut self, slots: Slots, stamp: Stamp) {
        slots.all().for_each(|slot| self.joiner.end(slot));
        self.end = Some(stamp);
    }

    pub(crate) fn take(
        &mut self,
        slot: usize,
        item: Item<T>,
        status: Status,
        context: &Context<'_>,
    ) {
        let account = context.account();
        account.received();
        let stamp = item.stamp;
        if let Some(Some(copy)) = self.remember.get(slot)
            && status == Status::OK
        {
            // The message may be too late for its own frame, but useful for the next one.
            let value = copy(&item.value);
            self.last.keep(slot, stamp.frame, stamp.captured_at_nanos, value);
        }
        match self.joiner.push(slot, stamp.frame, item, context.now()) {
            Push::Taken => {}
            Push::Late => account.dropped(Cause::Late, 1),
            Push::Full => account.dropped(Cause::QueueFull, 1),
        }
    }
}
