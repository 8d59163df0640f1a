//! Reasons why a receiver rejects a message.

/// Reason why a receiver rejected a message: its sender is faulty, or does not belong to the deployment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refusal {
    /// The message belongs to another session.
    Session,
    /// The view, pair or process of the message is not the one that the topic belongs to.
    Sender,
    /// The time or frame number of the message is in the future.
    Time,
    /// A count or a size does not match that of the receiver.
    Size,
    /// An index is out of range.
    Index,
    /// A number is not finite, or is negative where it must not be.
    Number,
}

impl Refusal {
    /// Number of causes.
    pub const N: usize = 6;

    /// All causes, in the order of [`Health::refused`](crate::Health::refused).
    pub const ALL: [Self; Self::N] = [
        Self::Session,
        Self::Sender,
        Self::Time,
        Self::Size,
        Self::Index,
        Self::Number,
    ];

    /// Returns the name for messages to users.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Session => "session",
            Self::Sender => "sender",
            Self::Time => "time",
            Self::Size => "size",
            Self::Index => "index",
            Self::Number => "number",
        }
    }
}
