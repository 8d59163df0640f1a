//! Source of the expected errors of the parts.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Source of the expected errors of the parts in every view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"shipped\", an ONNX file, or { table = \"...\", subject = \"...\", action = \"...\", \
                 views = { CAMERA = \"...\" }, frame_offset = 0, frame_step = 1 }"
)]
pub enum Errors {
    /// A network that predicts the errors from the frames.
    Network(PathBuf),
    /// A table that contains the errors.
    Table(ErrorTable),
}

/// A table of expected errors. Its columns are subject, action, frame, camera, then one error in pixels for each part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ErrorTable {
    /// File with the table.
    pub table: PathBuf,
    /// Subject in the table; not set if the table has none.
    pub subject: Option<String>,
    /// Action in the table; not set if the table has none.
    pub action: Option<String>,
    /// Map from the name of a camera in the deployment to its name in the table. A camera that is not listed has the same name in both.
    #[serde(default)]
    pub views: BTreeMap<String, String>,
    /// Number that the table gives to the footage's frame 0.
    #[serde(default)]
    pub frame_offset: i64,
    /// Frames of the table per frame of the footage.
    #[serde(default = "one")]
    pub frame_step: u32,
}

fn one() -> u32 {
    1
}

impl Errors {
    /// Returns the network, if one predicts the errors.
    pub fn network(&self) -> Option<&PathBuf> {
        match self {
            Self::Network(file) => Some(file),
            Self::Table(_) => None,
        }
    }

    /// Returns the table, if one contains the errors.
    pub fn table(&self) -> Option<&ErrorTable> {
        match self {
            Self::Table(table) => Some(table),
            Self::Network(_) => None,
        }
    }
}

impl ErrorTable {
    /// Returns the name of a camera in the table.
    pub fn name_of<'a>(&'a self, camera: &'a str) -> &'a str {
        self.views.get(camera).map_or(camera, String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_has_its_own_name_in_the_error_table_unless_another_is_set() {
        let text = "table = 't.csv'\nviews = { left = 'C1' }";
        let table: ErrorTable = toml::from_str(text).unwrap();
        assert_eq!(table.name_of("left"), "C1");
        assert_eq!(table.name_of("right"), "right");
        assert_eq!((table.frame_offset, table.frame_step), (0, 1));
    }
}
