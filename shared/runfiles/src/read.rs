//! Converts text to types and back, with errors that name the line and the field.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{FrameLine, TimesLine, ViewLine};

/// A line of a file with one JSON object per line.
pub trait Line: Serialize + DeserializeOwned {
    /// Name of the file.
    const FILE: &'static str;
}

impl Line for FrameLine {
    const FILE: &'static str = "pose3d.jsonl";
}

impl Line for ViewLine {
    const FILE: &'static str = "pose2d.jsonl";
}

impl Line for TimesLine {
    const FILE: &'static str = "times.jsonl";
}

/// Reason why a text is not valid content of its file. It names the position and the problem, but not the file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {}{problem}", in_field(field))]
pub struct ReadError {
    /// Number of the line, counted from 1.
    pub line: usize,
    /// Number of the column, counted from 1.
    pub column: usize,
    /// Path of the field, such as `summary.frames`; empty for the whole text.
    pub field: String,
    /// Content that was found, and content that was expected.
    pub problem: String,
}

fn in_field(field: &str) -> String {
    if field.is_empty() {
        String::new()
    } else {
        format!("field `{field}`: ")
    }
}

/// Reads a file of lines, line by line.
///
/// # Errors
///
/// Returns a [`ReadError`] for each malformed line.
pub fn lines<L: Line>(text: &str) -> impl Iterator<Item = Result<L, ReadError>> {
    let numbered = text.lines().enumerate();
    numbered.map(|(before, line)| {
        let located = |error: ReadError| ReadError {
            line: error.line + before,
            ..error
        };
        parse(line).map_err(located)
    })
}

/// Returns the text of one line, with its line end.
///
/// # Errors
///
/// Never fails for the lines of this crate. The error type is that of `serde_json`.
pub fn to_line<L: Line>(line: &L) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string(line)? + "\n")
}

/// Returns the text of a file that is one object, with its line end.
pub(crate) fn to_text(object: &impl Serialize) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string_pretty(object)? + "\n")
}

/// Reads one object.
pub(crate) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, ReadError> {
    let mut json = serde_json::Deserializer::from_str(text);
    let located = |error: &serde_json::Error, field: String| {
        let place = format!(" at line {} column {}", error.line(), error.column());
        let problem = error.to_string();
        ReadError {
            line: error.line().max(1),
            column: error.column().max(1),
            field: if field == "." { String::new() } else { field },
            problem: problem.strip_suffix(&place).unwrap_or(&problem).to_owned(),
        }
    };
    let value = serde_path_to_error::deserialize(&mut json)
        .map_err(|error| located(error.inner(), error.path().to_string()))?;
    json.end().map_err(|error| located(&error, String::new()))?;
    Ok(value)
}
