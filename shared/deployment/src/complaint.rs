//! What is wrong with the value of a key, and the kinds of value that are asked for.

use crate::ConfigError;

/// A value that cannot be.
#[derive(Debug, Clone, PartialEq)]
pub struct Complaint {
    /// The key, with its section.
    pub key: String,
    /// Its value.
    pub got: String,
    /// What would do.
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

/// A number of things from `least` to `most`.
pub(super) fn within(key: &str, got: usize, least: usize, most: usize) -> Result<(), Complaint> {
    let expected = format!("{least} to {most}");
    demand(
        (least..=most).contains(&got),
        key,
        &got.to_string(),
        &expected,
    )
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

/// A number from `least` to `most`.
pub(super) fn between(key: &str, got: f64, least: f64, most: f64) -> Result<(), Complaint> {
    demand(
        (least..=most).contains(&got),
        key,
        &got.to_string(),
        &format!("{least} to {most}"),
    )
}

/// A whole number from `least` to `most`.
pub(super) fn whole(key: &str, got: u64, least: u64, most: u64) -> Result<(), Complaint> {
    demand(
        (least..=most).contains(&got),
        key,
        &got.to_string(),
        &format!("{least} to {most}"),
    )
}
