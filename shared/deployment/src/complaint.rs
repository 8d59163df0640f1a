//! Complaints about the value of a key, and the kinds of value that are asked for.

use core::fmt::Display;

use crate::ConfigError;
use crate::ranges::range;

/// A value that is not allowed.
#[derive(Debug, Clone, PartialEq)]
pub struct Complaint {
    /// The key, with its section.
    pub key: String,
    /// Its value.
    pub got: String,
    /// Description of the values that are accepted.
    pub expected: String,
}

impl Complaint {
    /// The same with its place: file and line, or the option of the command line.
    pub fn at(self, place: String) -> ConfigError {
        ConfigError::Value {
            place,
            key: self.key,
            got: self.got,
            expected: self.expected,
        }
    }
}

/// A complaint about a key unless something holds.
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

/// A number above 0.
pub(super) fn positive(key: &str, got: f64) -> Result<(), Complaint> {
    demand(
        got.is_finite() && got > 0.0,
        key,
        &got.to_string(),
        "a number above 0",
    )
}

/// A number of at least 0.
pub(super) fn not_negative(key: &str, got: f64) -> Result<(), Complaint> {
    demand(
        got.is_finite() && got >= 0.0,
        key,
        &got.to_string(),
        "a number of at least 0",
    )
}

/// A number from the least to the most of its key.
pub(super) fn between(key: &str, got: f64) -> Result<(), Complaint> {
    in_range(key, got, &got.to_string())
}

/// A whole number from the least to the most of its key.
pub(super) fn whole<T: TryInto<i64> + Display + Copy>(key: &str, got: T) -> Result<(), Complaint> {
    // What does not fit is larger than anything that is allowed.
    let value = got.try_into().unwrap_or(i64::MAX);
    in_range(key, value as f64, &got.to_string())
}

fn in_range(key: &str, value: f64, got: &str) -> Result<(), Complaint> {
    let [least, most] = range(key);
    let expected = format!("{least} to {most}");
    demand((least..=most).contains(&value), key, got, &expected)
}
