//! How a topic treats a slow receiver, and how many ports and buffers it has.

/// Behaviour when a receiver is slower than its sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Delivery {
    /// The sender never waits. A full buffer drops its oldest message, so that the receiver gets the latest frame.
    #[default]
    Realtime,
    /// Nothing is lost. A full buffer makes the sender wait.
    Lossless,
}

/// The number of ports of a topic, and their buffers.
///
/// Memory is reserved for the worst case, so that a sender never lacks memory. Each publisher has `subscribers * (buffer + borrowed) +
/// onlookers * (buffer + 1) + loaned` chunks, unless [`TopicPlan::with_few_chunks`](crate::TopicPlan::with_few_chunks) is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Maximum number of publishers.
    pub publishers: usize,
    /// Maximum number of subscribers.
    pub subscribers: usize,
    /// Maximum number of subscribers that no publisher waits for ([`Bus::as_onlooker`](crate::Bus::as_onlooker)). Each may
    /// borrow one message at a time.
    pub onlookers: usize,
    /// Queue length of a subscriber, in messages.
    pub buffer: usize,
    /// Number of messages that one subscriber may borrow at the same time.
    pub borrowed: usize,
    /// Number of messages that one publisher may have on loan at the same time.
    pub loaned: usize,
}

impl Limits {
    /// Returns the limits for one publisher that writes one message at a time.
    ///
    /// * `buffer`: queue length of a subscriber, in messages.
    /// * `borrowed`: number of messages that one subscriber may borrow at the same time.
    pub fn new(subscribers: usize, buffer: usize, borrowed: usize) -> Self {
        Self {
            publishers: 1,
            subscribers,
            onlookers: 0,
            buffer,
            borrowed,
            loaned: 1,
        }
    }

    /// Adds onlookers to the limits.
    #[must_use]
    pub fn with_onlookers(self, onlookers: usize) -> Self {
        Self { onlookers, ..self }
    }
}
