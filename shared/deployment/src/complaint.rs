//! Complaints about the value of a key, and checks for common kinds of values.

use core::fmt::Display;

use crate::ConfigError;
use crate::ranges::range;

/// A value that is not allowed.
#[derive(Debug, Clone, PartialEq)]
pub struct Complaint {
    /// The key, with its section.
    pub key: String,
    /// The value that was given.
    pub got: String,
    /// Description of the values that are accepted.
    pub expected: String,
}

impl Complaint {
    /// Returns the error at a place: a file and line, or the option of the command line.
    pub fn at(self, place: String) -> ConfigError {
        ConfigError::Value {
            place,
            key: self.key,
            got: self.got,
            expected: self.expected,
        }
    }
}

/// Returns a complaint about a key unless a condition is met.
pub(super) fn demand(holds: bool, key: &str, got: &str, expected: &str) -> Result<(), Complaint> {
    if holds {
        return Ok(());
    }
    Err(Complaint {
        key: key.to_owned(),
        got: got.to_owned(),
        expected: expected.to_owned(),
    })
}

/// Checks that a number is above 0.
pub(super) fn positive(key: &str, got: f64) -> Result<(), Complaint> {
    demand(
        got.is_finite() && got > 0.0,
        key,
        &got.to_string(),
        "a number above 0",
    )
}

/// Checks that a number is at least 0.
pub(super) fn not_negative(key: &str, got: f64) -> Result<(), Complaint> {
    demand(
        got.is_finite() && got >= 0.0,
        key,
        &got.to_string(),
        "a number of at least 0",
    )
}

/// Checks that a number is in the range of its key.
pub(super) fn between(key: &str, got: f64) -> Result<(), Complaint> {
    in_range(key, got, &got.to_string())
}

/// Checks that a whole number is in the range of its key.
pub(super) fn whole<T: TryInto<i64> + Display + Copy>(key: &str, got: T) -> Result<(), Complaint> {
    // A number that does not fit into an `i64` is above every allowed maximum.
    let value = got.try_into().unwrap_or(i64::MAX);
    in_range(key, value as f64, &got.to_string())
}

fn in_range(key: &str, value: f64, got: &str) -> Result<(), Complaint> {
    let [least, most] = range(key);
    let expected = format!("{least} to {most}");
    demand((least..=most).contains(&value), key, got, &expected)
}
