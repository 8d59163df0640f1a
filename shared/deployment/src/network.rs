//! Section `[network]` of a deployment file: the keys of the network's method.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::shipped::{SHIPPED, relative_to};

/// The network that finds the joints of people, and the detector that finds the people.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Network")]
pub struct Config {
    /// Network that finds joints: `"shipped"`, or an ONNX file with its card in its metadata or beside it (`.toml` for `.onnx`).
    pub file: PathBuf,
    /// Detector that finds people and gives their boxes to the network: `"shipped"`, or an ONNX file with its card in its metadata or
    /// beside it.
    pub detector: PathBuf,
    /// Interval between searches for people, in frames; by default, there are two searches per second, or eight while people are near each
    /// other or just after a person has appeared or left.
    pub find_every: Option<u64>,
    /// Minimum heat (from 0 to 1, as the mean over the joints) at which a person counts as visible.
    pub least_heat: f64,
    /// Maximum number of people in a view, and in a frame.
    pub people: usize,
    /// Mean number of runs of the network per frame and view; people on whom it does not run are predicted; by default, the network runs on
    /// everybody or, in `realtime` mode, as often as the cores manage.
    pub looks: Option<f64>,
    /// Average the results of each person's picture and its mirror image; this is more accurate, but takes twice as long.
    pub mirror: bool,
    /// ONNX Runtime library (`libonnxruntime.so`) that runs the network and the detector instead of the built-in runtime.
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
            looks: None,
            mirror: false,
            onnx_runtime: None,
        }
    }
}

impl Config {
    /// Resolves every relative path against `base`.
    pub(crate) fn resolve(&mut self, base: &Path) {
        self.file = relative_to(&self.file, base);
        self.detector = relative_to(&self.detector, base);
        if let Some(file) = &mut self.onnx_runtime {
            *file = base.join(&file);
        }
    }
}
