//! Why a receiver refused a message.

/// Why a receiver refused a message: its sender is broken, or is no part of the deployment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Refusal {
    /// It is from another run.
    Session,
    /// It does not come from whom the topic belongs to: another view, pair or process.
    Sender,
    /// It speaks of a time or a frame that nobody can have seen yet.
    Time,
    /// A count or a size is not what the receiver works on.
    Size,
    /// An index points outside.
    Index,
    /// A number is not finite, or negative where it may not be.
    Number,
}

impl Refusal {
    /// How many causes there are.
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

    /// In a word.
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
