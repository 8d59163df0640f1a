//! Section `[quality]` of a deployment file.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use viewquality::{Device, Selection};

/// Where the expected errors of the parts come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Network that predicts the errors, an ONNX file; in place of a table.
    pub network: Option<PathBuf>,
    /// ONNX Runtime, a library (`libonnxruntime.so`) that runs the network in place of the one built in; needs a
    /// Parallax that was built with the feature `ort`.
    pub onnx_runtime: Option<PathBuf>,
    /// What ONNX Runtime runs it on.
    pub device: Device,
    /// How long a frame waits for its expected errors where the latest wins, milliseconds.
    pub deadline_ms: u64,
    /// How old the last expected errors of a view may be to be used instead, milliseconds.
    pub max_age_ms: u64,
    /// Table of expected errors; without one and without a network there are no predictions, and every
    /// part counts.
    pub table: Option<PathBuf>,
    /// The subject's name in the table; not given where the table names none.
    pub subject: Option<String>,
    /// The action's name in the table; not given where the table names none.
    pub action: Option<String>,
    /// What cameras are called in the table, by their own names; the same where not given.
    pub views: BTreeMap<String, String>,
    /// The table's number of frame 0 of the footage.
    pub frame_offset: i64,
    /// Frames of the table per frame of the footage, at least 1.
    pub frame_step: u32,
}

impl Default for Config {
    fn default() -> Self {
        let selection = Selection::default();
        Self {
            network: None,
            onnx_runtime: None,
            device: Device::Cpu,
            deadline_ms: 50,
            max_age_ms: 500,
            table: None,
            subject: None,
            action: None,
            views: BTreeMap::new(),
            frame_offset: selection.frame_offset,
            frame_step: selection.frame_step,
        }
    }
}

impl Config {
    /// Which rows of the table are meant.
    pub fn selection(&self) -> Selection {
        Selection {
            subject: self.subject.clone().unwrap_or_default(),
            action: self.action.clone().unwrap_or_default(),
            frame_offset: self.frame_offset,
            frame_step: self.frame_step,
        }
    }

    /// What a camera is called in the table.
    pub fn name_in_table<'a>(&'a self, camera: &'a str) -> &'a str {
        self.views.get(camera).map_or(camera, String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_has_its_own_name_in_the_table_unless_another_is_set() {
        let config = Config {
            views: BTreeMap::from([("left".to_owned(), "C1".to_owned())]),
            ..Config::default()
        };
        assert_eq!(config.name_in_table("left"), "C1");
        assert_eq!(config.name_in_table("right"), "right");
    }

    #[test]
    fn frame_numbers_of_the_table_follow_from_offset_and_step() {
        let config = Config {
            frame_offset: 80,
            frame_step: 4,
            ..Config::default()
        };
        assert_eq!(config.selection().table_frame(3), Some(92));
        assert_eq!(Config::default().selection(), Selection::default());
    }
}
