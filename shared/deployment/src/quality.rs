//! Section `[quality]` of a deployment file.

use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the expected errors of the parts come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Quality")]
pub struct Config {
    /// Network that predicts the errors of every view, an ONNX file, or `"shipped"`, the one that ships; in place of a
    /// table.
    pub network: Option<PathBuf>,
    /// `libonnxruntime.so`, to run the network in place of what is built in; needs a build with `--features ort`.
    pub onnx_runtime: Option<PathBuf>,
    /// What ONNX Runtime runs it on.
    pub device: Device,
    /// `realtime`: how long a frame waits for expected errors.
    pub deadline_ms: u64,
    /// How old the last expected errors of a view may be to be used instead; else its parts count.
    pub max_age_ms: u64,
    /// Expected errors: subject, action, frame, camera, then one per part, pixels.
    pub table: Option<PathBuf>,
    /// Subject in that table; not set where it names none.
    pub subject: Option<String>,
    /// Action in that table; not set where it names none.
    pub action: Option<String>,
    /// What cameras are called in that table, `{ camera = "name" }`; by their own names without it.
    pub views: BTreeMap<String, String>,
    /// Number of the footage's frame 0 in that table.
    pub frame_offset: i64,
    /// Frames of that table per frame of the footage.
    pub frame_step: u32,
}

/// What a network runs on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Device {
    /// One thread of the processor.
    #[default]
    Cpu,
    /// The first GPU of NVIDIA's.
    Cuda,
}

impl Default for Config {
    fn default() -> Self {
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
            frame_offset: 0,
            frame_step: 1,
        }
    }
}

impl Config {
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
}
