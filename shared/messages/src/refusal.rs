//! Why a receiver refused a message.

/// Why a receiver refused a message: its sender is faulty, or does not belong to the deployment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refusal {
    /// It belongs to another session.
    Session,
    /// Its view, pair or process is not the one that the topic belongs to.
    Sender,
    /// Its time or frame number lies in the future.
    Time,
    /// A count or a size does not match the receiver's.
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

    /// The name for people.
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
