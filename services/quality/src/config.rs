//! Section `[quality]` of a deployment file.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Where the expected errors of the parts come from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Table of expected errors; without one there are no predictions, and every part counts.
    pub table: Option<PathBuf>,
    /// The subject's name in the table.
    pub subject: Option<String>,
    /// The action's name in the table.
    pub action: Option<String>,
    /// Added to the index of a frame to get its number in the table.
    pub frame_offset: i64,
}
