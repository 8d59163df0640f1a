//! A deployment file: what a user starts, typed, with every default filled in.

mod error;
mod keys;
mod limits;
mod lists;
mod load;
mod places;
mod processes;
mod rules;

use std::path::{Path, PathBuf};

use scene::Address;
use serde::{Deserialize, Serialize};

pub(crate) use error::ConfigError;
pub(crate) use keys::Entry;
pub(crate) use load::Loaded;
pub(crate) use processes::Runtime;
pub(crate) use rules::fuse_numbers;

use crate::shipped;

/// Everything a user may say about a run. Defaults are those of the services' `Config`s.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Deployment {
    /// Name of the deployment: its processes share memory under it.
    pub name: String,
    /// Calibration of the cameras.
    pub rig: PathBuf,
    /// Unit of the lengths in it, where it is not what its format says.
    pub unit: Option<Unit>,
    /// Direction against gravity in its world; replaces what it says.
    pub up: Option<[f64; 3]>,
    /// Trained model; the one that ships with Parallax if not given.
    pub model: Option<PathBuf>,
    /// Folder for the results.
    pub output: PathBuf,
    /// Where the footage comes from, and how to get it: said where a file is missing.
    pub data: Option<String>,
    /// The cameras, in the order in which views are numbered.
    #[serde(rename = "camera")]
    pub cameras: Vec<capture::Camera>,
    /// How pixels get in.
    #[serde(default)]
    pub capture: capture::Config,
    /// The single-view solver.
    #[serde(default)]
    pub pose: pose::Config,
    /// Expected errors.
    #[serde(default)]
    pub quality: quality::Config,
    /// The energy over pairs of views.
    #[serde(default)]
    pub fuse: fuse::Config,
    /// Joints in the world.
    #[serde(default)]
    pub triangulate: triangulate::Config,
    /// What is left behind.
    #[serde(default)]
    pub results: results::Config,
    /// Deadlines and restarts.
    #[serde(default)]
    pub supervise: Supervision,
    /// Cores, priorities, and how processes wait.
    #[serde(default)]
    pub runtime: Runtime,
}

/// A unit of lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Unit {
    /// Metres.
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
}

impl From<Unit> for geometry::files::Unit {
    fn from(from: Unit) -> Self {
        match from {
            Unit::M => Self::Metres,
            Unit::Cm => Self::Centimetres,
            Unit::Mm => Self::Millimetres,
        }
    }
}

/// Section `[supervise]`: how long to wait, and how often to try again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct Supervision {
    /// How long a stage waits for a view that is late, milliseconds; by mode if not given.
    pub deadline_ms: Option<u64>,
    /// How long the main loop of a process may stand still before it is killed, seconds; by mode if
    /// not given.
    pub hang_limit_s: Option<u64>,
    /// How many signs of life, one every 150 ms, a process may miss that stands still because a signal
    /// stopped it; where the latest frame wins also for how many a turn of any process but `results` and `record` may
    /// compute, however short those before it were.
    pub missed_beats: u32,
    /// Most restarts of one process within the window before it is given up.
    pub max_restarts: u32,
    /// The window in which restarts are counted, seconds.
    pub restart_window_s: u64,
    /// Longest 99th percentile from capture to result with which a run succeeds, milliseconds; any if
    /// not given.
    pub latency_budget_ms: Option<f64>,
}

impl Default for Supervision {
    fn default() -> Self {
        Self {
            deadline_ms: None,
            hang_limit_s: None,
            missed_beats: 3,
            max_restarts: 5,
            restart_window_s: 60,
            latency_budget_ms: None,
        }
    }
}

impl Deployment {
    /// How long a stage waits for a view that is late, milliseconds.
    pub(crate) fn deadline_ms(&self) -> u64 {
        self.supervise
            .deadline_ms
            .unwrap_or(match self.capture.mode {
                capture::Mode::Lossless => 10_000,
                capture::Mode::Realtime => 200,
            })
    }

    /// How long the main loop of a process may stand still before it is killed, seconds.
    pub(crate) fn hang_limit_s(&self) -> u64 {
        self.supervise
            .hang_limit_s
            .unwrap_or(match self.capture.mode {
                capture::Mode::Lossless => 120,
                capture::Mode::Realtime => 10,
            })
    }

    /// Takes every relative path as relative to `base`.
    fn resolve(&mut self, base: &Path) {
        for path in [&mut self.rig, &mut self.output] {
            *path = base.join(&path);
        }
        if let Some(model) = &mut self.model {
            *model = shipped::relative_to(model, base);
        }
        for camera in &mut self.cameras {
            camera.source = source(&camera.source, base);
        }
        let quality = &mut self.quality;
        let files = [&mut quality.table, &mut quality.onnx_runtime];
        for file in files.into_iter().flatten() {
            *file = base.join(&file);
        }
        let may_ship = [&mut quality.network, &mut self.fuse.consistency];
        for file in may_ship.into_iter().flatten() {
            *file = shipped::relative_to(file, base);
        }
        if let fuse::Tau::File(tau) = &mut self.fuse.tau {
            tau.file = base.join(&tau.file);
        }
        for tables in &mut self.fuse.compatibility {
            for file in &mut tables.files {
                *file = base.join(&file);
            }
        }
    }
}

/// Footage as it is named in a file of the folder `base`; what is no file stays as it is, and is refused later.
fn source(named: &str, base: &Path) -> String {
    if Address::is_address(named) {
        return Address::relative_to(named, base);
    }
    let on_disk = base.join(named);
    if named.is_empty() || (footage::is_live(named) && !on_disk.exists()) {
        return named.to_owned();
    }
    on_disk.to_string_lossy().into_owned()
}
