//! Why a text was rejected as a model, and where.

use std::fmt;

use crate::ModelError;

/// The position of a token in a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextPosition {
    /// Line, from 1.
    pub line: usize,
    /// Token of the file, from 1.
    pub token: usize,
}

impl fmt::Display for TextPosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {} (token {})", self.line, self.token)
    }
}

/// Why a text was rejected as a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TextError {
    /// Another token where a keyword is expected.
    #[error("{place}: expected `{field}`, got `{got}`")]
    Keyword {
        /// The key word.
        field: &'static str,
        /// Where.
        place: TextPosition,
        /// Text in the file.
        got: String,
    },
    /// The text ends too early.
    #[error("{place}: the file ends within `{field}`")]
    Ended {
        /// The field that was being read.
        field: &'static str,
        /// Where.
        place: TextPosition,
    },
    /// A number cannot be read.
    #[error("{place}: `{field}` expects {kind}, got `{got}`")]
    Number {
        /// The field that was being read.
        field: &'static str,
        /// Where.
        place: TextPosition,
        /// Which numbers would do.
        kind: &'static str,
        /// Text in the file.
        got: String,
    },
    /// Two places of the file contradict each other.
    #[error("{place}: `{field}` says {what} = {got}, expected {expected}")]
    Disagrees {
        /// The field that was being read.
        field: &'static str,
        /// Where.
        place: TextPosition,
        /// Which number of the field.
        what: &'static str,
        /// The number.
        got: usize,
        /// The number according to other fields.
        expected: usize,
    },
    /// A count is beyond what a model may have.
    #[error("{place}: `{field}` is {got}, expected {min} to {max}")]
    Limit {
        /// The field that was being read.
        field: &'static str,
        /// Where.
        place: TextPosition,
        /// The count.
        got: usize,
        /// Least accepted.
        min: usize,
        /// Most accepted.
        max: usize,
    },
    /// A part is anchored at another level than its parent.
    #[error(
        "{place}: `defs_anchor` puts spring {spring} {got} octaves from its parent, expected 0"
    )]
    OtherLevel {
        /// Where the array begins.
        place: TextPosition,
        /// 1-based spring.
        spring: usize,
        /// The anchor's third component.
        got: i32,
    },
    /// Something follows the last field.
    #[error("{place}: expected the end of the file, got `{got}`")]
    Trailing {
        /// Where.
        place: TextPosition,
        /// Text in the file.
        got: String,
    },
    /// An index is out of range.
    #[error("the components name an entry that does not exist")]
    Index(#[from] ModelError),
}
