//! Why a message was refused.

use messages::Refusal;

/// A message is malformed, or a value does not fit into its message.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum WireError {
    /// A count is larger than the array that it counts.
    #[error("{field} is {got}, the limit is {limit}")]
    TooMany {
        /// The count.
        field: &'static str,
        /// Its value.
        got: usize,
        /// Largest value allowed.
        limit: usize,
    },
    /// Sender and receiver have different models, rigs or layouts.
    #[error("{field} is {got}, expected {expected}")]
    Mismatch {
        /// The number.
        field: &'static str,
        /// Its value.
        got: usize,
        /// The value that the receiver has.
        expected: usize,
    },
    /// An index is out of range.
    #[error("{field} of entry {entry} is {got}, the limit is {limit}")]
    OutOfRange {
        /// The index.
        field: &'static str,
        /// Which entry of its array, from 0.
        entry: usize,
        /// Its value.
        got: usize,
        /// Smallest value that is not allowed.
        limit: usize,
    },
    /// A number is not finite, or is negative where it may not be.
    #[error("{field} of entry {entry} is {got}, expected {expected}")]
    Value {
        /// The number.
        field: &'static str,
        /// Which entry of its array, from 0.
        entry: usize,
        /// Its value.
        got: f64,
        /// Description of the values that are accepted.
        expected: &'static str,
    },
    /// The message is from another run.
    #[error("session is {got}, expected {expected}")]
    Session {
        /// Its session.
        got: u64,
        /// The receiver's session.
        expected: u64,
    },
    /// The message does not come from the sender of the topic.
    #[error("{field} is {got}, but this is the topic of {expected}")]
    Sender {
        /// The field.
        field: &'static str,
        /// Its value.
        got: usize,
        /// The sender of the topic.
        expected: usize,
    },
    /// The message has a time in the future.
    #[error("{field} lies {} ms ahead of the clock", .ahead_nanos / 1_000_000)]
    Future {
        /// The time stamp.
        field: &'static str,
        /// How far ahead it is.
        ahead_nanos: u64,
    },
    /// The frame number is too large.
    #[error("{field} is {got}, the limit is {limit}")]
    Frame {
        /// The number.
        field: &'static str,
        /// Its value.
        got: u64,
        /// Largest value allowed.
        limit: u64,
    },
}

impl WireError {
    /// The cause under which the receiver counts it.
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

/// Refuses a count above `limit`.
pub(crate) fn count(field: &'static str, got: usize, limit: usize) -> Result<usize, WireError> {
    if got > limit {
        return Err(WireError::TooMany { field, got, limit });
    }
    Ok(got)
}

/// Refuses a number that differs from the receiver's.
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

/// Refuses an index that is not below `limit`.
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

/// Refuses a number that is not finite.
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
