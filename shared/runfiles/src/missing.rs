//! Reasons why a view did not contribute to a result.

use core::cmp::Ordering;
use core::fmt;

use serde::{Deserialize, Serialize};

/// Reason why a view did not contribute to a result; it is stored as text.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub enum Missing {
    /// The view answered too late, or had not answered yet.
    Late,
    /// The view skipped the frame and continued.
    Dropped,
    /// The process of the view, or the process that combines the views, had died.
    ProcessLost,
    /// The footage of the view has fewer frames.
    EndOfFootage,
    /// The view answered without a pose, for the given reason, or the frame could not be written.
    Other(String),
}

impl Missing {
    /// Text of [`Missing::Late`].
    pub const LATE: &'static str = "late";
    /// Text of [`Missing::Dropped`].
    pub const DROPPED: &'static str = "dropped";
    /// Text of [`Missing::ProcessLost`].
    pub const PROCESS_LOST: &'static str = "process lost";
    /// Text of [`Missing::EndOfFootage`].
    pub const END_OF_FOOTAGE: &'static str = "end of footage";

    /// Returns the text that is written.
    pub fn text(&self) -> &str {
        match self {
            Self::Late => Self::LATE,
            Self::Dropped => Self::DROPPED,
            Self::ProcessLost => Self::PROCESS_LOST,
            Self::EndOfFootage => Self::END_OF_FOOTAGE,
            Self::Other(text) => text,
        }
    }

    /// Returns true if the view has answered, without a pose.
    pub fn is_answer(&self) -> bool {
        matches!(self, Self::Other(_))
    }
}

impl From<&str> for Missing {
    fn from(text: &str) -> Self {
        match text {
            Self::LATE => Self::Late,
            Self::DROPPED => Self::Dropped,
            Self::PROCESS_LOST => Self::ProcessLost,
            Self::END_OF_FOOTAGE => Self::EndOfFootage,
            other => Self::Other(other.to_owned()),
        }
    }
}

impl From<String> for Missing {
    fn from(text: String) -> Self {
        text.as_str().into()
    }
}

impl From<Missing> for String {
    fn from(missing: Missing) -> Self {
        missing.text().to_owned()
    }
}

impl fmt::Display for Missing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

/// Orders by text, which is the order of keys in the files.
impl Ord for Missing {
    fn cmp(&self, other: &Self) -> Ordering {
        self.text().cmp(other.text())
    }
}

impl PartialOrd for Missing {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
