//! The deployment: the file that a user writes, and the processes and topics that follow from it.
//!
//! Suggested reading order:
//!
//! - [`Deployment`] and its sections: the keys, their meanings and defaults.
//! - [`Loaded`]: from text and `--set` options to a checked deployment.
//! - [`Topology`]: the processes, and the topics between them.
//!
//! This crate does no input or output. It queries the machine through a [`Machine`].
#![forbid(unsafe_code)]

pub mod capture;
pub mod hosts;
pub mod network;
pub mod paper;
pub mod person;
pub mod results;

mod fault;
mod processes;

mod clocks;
mod complaint;
mod device;
mod entries;
mod error;
mod fields;
mod keys;
mod limits;
mod lists;
mod live;
mod load;
mod machine;
mod method;
mod places;
mod ranges;
mod reference;
mod rules;
mod schema;
mod shipped;
mod slips;
mod timeline;
mod topology;

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use clocks::{ClockKeys, ClocksError, with_clocks};
pub use complaint::Complaint;
pub use device::Device;
pub use entries::{Entry, Origin};
pub use error::ConfigError;
pub use keys::keys;
pub use load::Loaded;
pub use machine::{AnyMachine, Machine};
pub use method::{Method, Views};
pub use processes::Runtime;
pub use ranges::MAX_CORES;
pub use reference::reference;
pub use rules::energy_numbers;
pub use schema::{Key, schema};
pub use shipped::{NONE, SHIPPED, is_none, is_shipped, relative_to};
pub use timeline::{OwnClock, Timeline};
pub use topology::{
    Content, Process, RecordingPlan, Replay, Role, Room, Stage, Topology, ViewSize,
};

/// Everything that a deployment file can set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Deployment {
    /// Name of the deployment; its processes share memory under this name.
    pub name: String,
    /// File with the calibration of the cameras.
    pub rig: PathBuf,
    /// Unit of length in the calibration, instead of the unit of its format: `"m"`, `"cm"`, `"mm"`, `"ft"`, `"in"`, or the side of a square
    /// such as `"30mm"`.
    pub unit: Option<String>,
    /// Up direction (opposite to gravity) in the world of the calibration, `[x, y, z]`; by default, from the calibration file or found in
    /// the pictures.
    pub up: Option<[f64; 3]>,
    /// Method for finding skeletons: a `network`, or the filters and the energy of the `paper`.
    #[serde(default)]
    pub method: Method,
    /// Hardware on which frames are searched: the processor (`cpu`), a graphics card (`gpu`), or a graphics card if a suitable one is
    /// present (`auto`).
    #[serde(default)]
    pub device: Device,
    /// Folder for the results.
    pub output: PathBuf,
    /// The cameras, one `[[camera]]` each, in the order of the views.
    #[serde(rename = "camera")]
    pub cameras: Vec<capture::Camera>,
    /// The machines, one `[[host]]` each, if there are several.
    #[serde(rename = "host", default, skip_serializing_if = "Vec::is_empty")]
    pub hosts: Vec<hosts::Host>,
    /// How pixels enter the pipeline.
    #[serde(default)]
    pub capture: capture::Config,
    /// The person to follow, and the joints.
    #[serde(default)]
    pub person: person::Config,
    /// Keys of the network's method.
    #[serde(default)]
    pub network: network::Config,
    /// Keys of the paper's method.
    #[serde(default)]
    pub paper: paper::Config,
    /// The files that a run writes.
    #[serde(default)]
    pub results: results::Config,
    /// The connection between hosts.
    #[serde(default)]
    pub link: hosts::Link,
    /// Deadlines and restarts.
    #[serde(default)]
    pub supervise: Supervision,
    /// Cores, priorities, and how processes wait.
    #[serde(default)]
    pub runtime: Runtime,
}

/// Section `[supervise]`: deadlines and numbers of restarts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Supervision {
    /// Time that a stage waits for a late view, in milliseconds; by default 10000, or 200 in `realtime` mode.
    pub deadline_ms: Option<u64>,
    /// Time that a process may hang before it is killed, in seconds; by default 120, or 10 in `realtime` mode.
    pub hang_limit_s: Option<u64>,
    /// Number of heartbeats, sent every 150 ms, that a process may miss before it is killed.
    pub missed_beats: u32,
    /// Maximum number of restarts of one process within a minute; after that, the supervisor gives up the process.
    pub max_restarts: u32,
    /// Limit for the 99th percentile of the time from capture to result, in milliseconds; the run fails if it is exceeded.
    pub latency_budget_ms: Option<f64>,
}

impl Default for Supervision {
    fn default() -> Self {
        Self {
            deadline_ms: None,
            hang_limit_s: None,
            missed_beats: 3,
            max_restarts: 5,
            latency_budget_ms: None,
        }
    }
}

impl Deployment {
    /// Returns true if the network's method is used, which works on maps of the joints.
    pub fn has_maps(&self) -> bool {
        self.method == Method::Network
    }

    /// Returns the network of a camera: its own, or the one for all cameras. Returns `None` if the camera has keypoints or the
    /// paper's method is used.
    pub fn pose_network(&self, camera: usize) -> Option<&Path> {
        let camera = &self.cameras[camera];
        let network = camera.network.as_ref().unwrap_or(&self.network.file);
        let has_one = self.has_maps() && camera.keypoints.is_none();
        has_one.then_some(network.as_path())
    }

    /// Returns the networks of all cameras, without duplicates.
    pub fn pose_networks(&self) -> Vec<&Path> {
        let mut networks: Vec<&Path> = Vec::new();
        for network in (0..self.cameras.len()).filter_map(|camera| self.pose_network(camera)) {
            if !networks.contains(&network) {
                networks.push(network);
            }
        }
        networks
    }

    /// Returns true if expected errors are predicted from the frames.
    pub fn predicts_errors(&self) -> bool {
        let errors = self.paper.errors.as_ref();
        errors.is_some_and(|errors| errors.network().is_some())
    }

    /// Returns true if any process sends expected errors.
    pub fn has_quality(&self) -> bool {
        self.paper.errors.is_some()
    }

    /// Returns the time that a stage waits for a late view, in milliseconds.
    pub fn deadline_ms(&self) -> u64 {
        self.supervise.deadline_ms.unwrap_or(match self.capture.mode {
            capture::Mode::Lossless | capture::Mode::Paced => 10_000,
            capture::Mode::Realtime => 200,
        })
    }

    /// Returns the time that the main loop of a process may hang before the process is killed, in seconds.
    pub fn hang_limit_s(&self) -> u64 {
        self.supervise.hang_limit_s.unwrap_or(match self.capture.mode {
            capture::Mode::Lossless | capture::Mode::Paced => 120,
            capture::Mode::Realtime => 10,
        })
    }

    /// Resolves every relative path against `base`.
    fn resolve(&mut self, base: &Path, machine: &dyn Machine) {
        for path in [&mut self.rig, &mut self.output] {
            *path = base.join(&path);
        }
        for camera in &mut self.cameras {
            if !camera.source.is_empty() {
                camera.source = machine.footage(&camera.source, base);
            }
            if let Some(keypoints) = &mut camera.keypoints {
                *keypoints = base.join(&keypoints);
            }
            if let Some(network) = &mut camera.network {
                *network = relative_to(network, base);
            }
        }
        self.link.resolve(base);
        self.network.resolve(base);
        self.paper.resolve(base);
    }
}
