//! The error for a text that was rejected as a model, with its position.

use std::fmt;

use crate::ModelError;

/// The position of a token in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextPosition {
    /// Line, counted from 1.
    pub line: usize,
    /// Token of the file, counted from 1.
    pub token: usize,
}

impl fmt::Display for TextPosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {} (token {})", self.line, self.token)
    }
}

/// Reason why a text was rejected as a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TextError {
    /// A keyword is expected, but another token was found.
    #[error("{place}: expected `{field}`, got `{got}`")]
    Keyword {
        /// The expected keyword.
        field: &'static str,
        /// Position in the text.
        place: TextPosition,
        /// Text found in the file.
        got: String,
    },
    /// The text ends too early.
    #[error("{place}: the file ends within `{field}`")]
    Ended {
        /// The field that was being read.
        field: &'static str,
        /// Position in the text.
        place: TextPosition,
    },
    /// A number cannot be read.
    #[error("{place}: `{field}` expects {kind}, got `{got}`")]
    Number {
        /// The field that was being read.
        field: &'static str,
        /// Position in the text.
        place: TextPosition,
        /// Description of the expected numbers.
        kind: &'static str,
        /// Text found in the file.
        got: String,
    },
    /// Two fields of the file contradict each other.
    #[error("{place}: `{field}` says {what} = {got}, expected {expected}")]
    Disagrees {
        /// The field that was being read.
        field: &'static str,
        /// Position in the text.
        place: TextPosition,
        /// Name of the number in the field.
        what: &'static str,
        /// The number found.
        got: usize,
        /// The number required by other fields.
        expected: usize,
    },
    /// A count exceeds the limits of a model.
    #[error("{place}: `{field}` is {got}, expected {min} to {max}")]
    Limit {
        /// The field that was being read.
        field: &'static str,
        /// Position in the text.
        place: TextPosition,
        /// Value of the count.
        got: usize,
        /// Minimum accepted value.
        min: usize,
        /// Maximum accepted value.
        max: usize,
    },
    /// The anchor of a part is on another level than its parent.
    #[error(
        "{place}: `defs_anchor` puts spring {spring} at {got} octaves from its parent, expected 0"
    )]
    OtherLevel {
        /// Start of the array in the text.
        place: TextPosition,
        /// The spring in question, counted from 1.
        spring: usize,
        /// The anchor's third component.
        got: i32,
    },
    /// There is text after the last field.
    #[error("{place}: expected the end of the file, got `{got}`")]
    Trailing {
        /// Position in the text.
        place: TextPosition,
        /// Text found in the file.
        got: String,
    },
    /// An index is out of range.
    #[error("an index in the components refers to an entry that does not exist")]
    Index(#[from] ModelError),
}
