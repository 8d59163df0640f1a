//! Slots of the joiner that an input fills.

/// The slots of the joiner that an input fills: `first`, and every `step`-th after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Slots {
    pub(crate) first: usize,
    pub(crate) end: usize,
    pub(crate) step: usize,
    /// Slot of message 0 of a worker's topic; `None` if all messages go to `first`.
    pub(crate) base: Option<usize>,
}

impl Slots {
    pub(crate) fn one(slot: usize) -> Self {
        Self {
            first: slot,
            end: slot + 1,
            step: 1,
            base: None,
        }
    }

    pub(crate) fn all(self) -> impl Iterator<Item = usize> {
        (self.first..self.end).step_by(self.step.max(1))
    }

    /// Returns the slot of a message.
    pub(crate) fn of(self, stamp_view: usize) -> usize {
        self.base.map_or(self.first, |base| base + stamp_view)
    }
}
