//! Section `[network]` of a deployment file: the keys that only the network's method has.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::shipped::{SHIPPED, relative_to};

/// The network that finds the joints of people, and where it looks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Network")]
pub struct Config {
    /// The network that finds joints: an ONNX file with its card beside it (`.toml` for `.onnx`) or in its metadata, or `"shipped"`.
    pub file: PathBuf,
    /// The detector of people, which finds boxes for the network: an ONNX file with its card beside it or in its metadata, or `"shipped"`.
    pub detector: PathBuf,
    /// Search for people in every n-th frame; by default twice a second, and eight times while several people are near each other or one of them came or went.
    pub find_every: Option<u64>,
    /// Least mean heat of the joints of a visible person, 0 to 1.
    pub least_heat: f64,
    /// Most people in a view, and in a frame.
    pub people: usize,
    /// Use the mean with the mirror image of every person, which is more exact and takes twice the time.
    pub mirror: bool,
    /// The library of ONNX Runtime (`libonnxruntime.so`) that runs network and detector in place of the built-in runtime.
    pub onnx_runtime: Option<PathBuf>,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            file: PathBuf::from(SHIPPED),
            detector: PathBuf::from(SHIPPED),
            find_every: None,
            least_heat: 0.2,
            people: 4,
            mirror: false,
            onnx_runtime: None,
        }
    }
}

impl Config {
    /// Takes every relative path as relative to `base`.
    pub(crate) fn resolve(&mut self, base: &Path) {
        self.file = relative_to(&self.file, base);
        self.detector = relative_to(&self.detector, base);
        if let Some(file) = &mut self.onnx_runtime {
            *file = base.join(&file);
        }
    }
}
