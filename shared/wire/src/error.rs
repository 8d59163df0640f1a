//! Why a message was refused.

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
