//! Reasons why a message was rejected.

use messages::Refusal;

/// Reason why a message is malformed, or why a value does not fit into its message.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WireError {
    /// A count is larger than the array that it counts.
    #[error("{field} is {got}, but the limit is {limit}")]
    TooMany {
        /// Name of the count.
        field: &'static str,
        /// Value of the count.
        got: usize,
        /// Maximum value allowed.
        limit: usize,
    },
    /// The sender and the receiver use different models, rigs or layouts.
    #[error("{field} is {got}, expected {expected}")]
    Mismatch {
        /// Name of the number.
        field: &'static str,
        /// Value of the number.
        got: usize,
        /// The value that the receiver has.
        expected: usize,
    },
    /// An index is out of range.
    #[error("{field} of entry {entry} is {got}, but the limit is {limit}")]
    OutOfRange {
        /// Name of the index.
        field: &'static str,
        /// Index of the entry in its array, counted from 0.
        entry: usize,
        /// Value of the index.
        got: usize,
        /// Smallest value that is too large.
        limit: usize,
    },
    /// A number is not finite, or is negative where it must not be.
    #[error("{field} of entry {entry} is {got}, expected {expected}")]
    Value {
        /// Name of the number.
        field: &'static str,
        /// Index of the entry in its array, counted from 0.
        entry: usize,
        /// Value of the number.
        got: f64,
        /// Description of the values that are accepted.
        expected: &'static str,
    },
    /// The message is from another run.
    #[error("session is {got}, expected {expected}")]
    Session {
        /// Session of the message.
        got: u64,
        /// Session of the receiver.
        expected: u64,
    },
    /// The message does not come from the process that is the sender of this topic.
    #[error("{field} is {got}, but the sender of this topic must be {expected}")]
    Sender {
        /// Name of the field.
        field: &'static str,
        /// Value of the field.
        got: usize,
        /// Sender that the topic belongs to.
        expected: usize,
    },
    /// The message has a time in the future.
    #[error("{field} is {} ms ahead of the clock", .ahead_nanos / 1_000_000)]
    Future {
        /// Name of the time stamp.
        field: &'static str,
        /// Time by which the time stamp is ahead of the clock, in nanoseconds.
        ahead_nanos: u64,
    },
    /// The frame number is too large.
    #[error("{field} is {got}, but the limit is {limit}")]
    Frame {
        /// Name of the number.
        field: &'static str,
        /// Value of the number.
        got: u64,
        /// Maximum value allowed.
        limit: u64,
    },
}

impl WireError {
    /// Returns the cause under which the receiver counts the rejected message.
    pub fn refusal(&self) -> Refusal {
        match self {
            Self::TooMany { .. } | Self::Mismatch { .. } => Refusal::Size,
            Self::OutOfRange { .. } => Refusal::Index,
            Self::Value { .. } => Refusal::Number,
            Self::Session { .. } => Refusal::Session,
            Self::Sender { .. } => Refusal::Sender,
            Self::Future { .. } | Self::Frame { .. } => Refusal::Time,
        }
    }
}

/// Returns an error for a count above `limit`.
pub(crate) fn count(field: &'static str, got: usize, limit: usize) -> Result<usize, WireError> {
    if got > limit {
        return Err(WireError::TooMany { field, got, limit });
    }
    Ok(got)
}

/// Returns an error for a number that differs from the receiver's number.
pub(crate) fn equal(field: &'static str, got: usize, expected: usize) -> Result<(), WireError> {
    if got != expected {
        return Err(WireError::Mismatch {
            field,
            got,
            expected,
        });
    }
    Ok(())
}

/// Returns an error for an index that is not below `limit`.
pub(crate) fn index(
    field: &'static str,
    entry: usize,
    got: usize,
    limit: usize,
) -> Result<usize, WireError> {
    if got >= limit {
        return Err(WireError::OutOfRange {
            field,
            entry,
            got,
            limit,
        });
    }
    Ok(got)
}

/// Returns an error for a number that is not finite.
pub(crate) fn finite(field: &'static str, entry: usize, got: f64) -> Result<f64, WireError> {
    if !got.is_finite() {
        return Err(WireError::Value {
            field,
            entry,
            got,
            expected: "a finite number",
        });
    }
    Ok(got)
}
