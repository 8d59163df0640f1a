//! Why a message was refused.

use messages::Refusal;

/// A message says something that cannot be, or a value does not fit into its message.
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
    /// Sender and receiver do not work on the same thing.
    #[error("{field} is {got}, expected {expected}")]
    Mismatch {
        /// The number.
        field: &'static str,
        /// Its value.
        got: usize,
        /// The value that the receiver has.
        expected: usize,
    },
    /// An index points outside.
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
        /// What would do.
        expected: &'static str,
    },
    /// The message is from another run.
    #[error("session is {got}, expected {expected}")]
    Session {
        /// The run that it names.
        got: u64,
        /// The receiver's.
        expected: u64,
    },
    /// The message does not come from whom the topic belongs to.
    #[error("{field} is {got}, but this is the topic of {expected}")]
    Sender {
        /// What it names.
        field: &'static str,
        /// The sender that it names.
        got: usize,
        /// The one that the topic belongs to.
        expected: usize,
    },
    /// The message speaks of a time that has not come yet.
    #[error("{field} lies {} ms ahead of the clock", .ahead_nanos / 1_000_000)]
    Future {
        /// The time stamp.
        field: &'static str,
        /// How far ahead it is.
        ahead_nanos: u64,
    },
    /// No footage has so many frames.
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
    /// Under which cause the receiver counts it.
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

/// Refuses a number that is not the receiver's.
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
