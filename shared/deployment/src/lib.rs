//! The deployment: the file that a user writes, and the processes and topics that follow from it.
//!
//! Reading order: [`Deployment`] and its sections (the keys, their meanings and defaults), [`Loaded`] (from text and
//! `--set` options to a deployment that was checked), [`Topology`] (which processes run, and who sends to whom).
//!
//! Pure: texts in, values out. What only the machine can tell is asked of a [`Machine`].
#![forbid(unsafe_code)]

pub mod capture;
pub mod fuse;
pub mod hosts;
pub mod person;
pub mod pose;
pub mod quality;
pub mod results;
pub mod smooth;
pub mod triangulate;

mod fault;
mod processes;

mod clocks;
mod complaint;
mod default_network;
mod entries;
mod error;
mod fields;
mod keys;
mod limits;
mod lists;
mod live;
mod load;
mod machine;
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
pub use entries::{Entry, Origin};
pub use error::ConfigError;
pub use keys::keys;
pub use load::Loaded;
pub use machine::{AnyMachine, Machine};
pub use processes::{Policy, Runtime};
pub use ranges::MAX_CORES;
pub use reference::reference;
pub use rules::fuse_numbers;
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
    /// Name of the deployment: its processes share memory under it.
    pub name: String,
    /// Calibration of the cameras.
    pub rig: PathBuf,
    /// Unit of the lengths in the calibration, where it is not what its format tells: `"m"`, `"cm"`, `"mm"`, `"ft"`, `"in"`, or a length
    /// such as `"30mm"`, of a calibration in squares of the board.
    pub unit: Option<String>,
    /// Direction against gravity in the world of the calibration, `[x, y, z]`; replaces what the file has; found from
    /// cameras and people where neither gives it.
    pub up: Option<[f64; 3]>,
    /// Trained model; the one that ships with Parallax without it, or with the word `"shipped"`.
    pub model: Option<PathBuf>,
    /// Folder for the results.
    pub output: PathBuf,
    /// Where the footage comes from, and how to get it: shown where a file that is named here is missing.
    pub data: Option<String>,
    /// The cameras, each a `[[camera]]` of its own, in the order in which views are numbered.
    #[serde(rename = "camera")]
    pub cameras: Vec<capture::Camera>,
    /// The machines, each a `[[host]]` of its own, where one is not enough; none means this machine alone.
    #[serde(rename = "host", default, skip_serializing_if = "Vec::is_empty")]
    pub hosts: Vec<hosts::Host>,
    /// How pixels get in.
    #[serde(default)]
    pub capture: capture::Config,
    /// Who is followed.
    #[serde(default)]
    pub person: person::Config,
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
    /// Smoothed trajectories.
    #[serde(default)]
    pub smooth: smooth::Config,
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

/// Section `[supervise]`: how long to wait, and how often to try again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Supervision {
    /// How long a stage waits for a late view; 10000 lossless, 200 realtime.
    pub deadline_ms: Option<u64>,
    /// How long a process may stand still before it is killed, seconds; 120 lossless, 10 realtime.
    pub hang_limit_s: Option<u64>,
    /// Signs of life, one every 150 ms, that a stopped process (SIGSTOP) may miss before it is killed; realtime: and
    /// for how many of them a turn of any but `results` and `record` may compute, however short those before it were.
    pub missed_beats: u32,
    /// Restarts of one process within the window before it is given up.
    pub max_restarts: u32,
    /// The window in which restarts are counted, seconds.
    pub restart_window_s: u64,
    /// A run fails if 1 frame in 100 takes longer from capture to result; none without it.
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
    /// Whether networks that find keypoints, or keypoints that other programs found, take the place of the filters.
    pub fn has_maps(&self) -> bool {
        let has_own = |it: &capture::Camera| it.network.is_some() || it.keypoints.is_some();
        self.pose.network.is_some() || self.cameras.iter().any(has_own)
    }

    /// The network of a camera and its card: its own, or that of all; none if it has keypoints.
    pub fn pose_network(&self, camera: usize) -> Option<(&Path, Option<&Path>)> {
        let it = &self.cameras[camera];
        let own = (&it.network, &it.network_card);
        let of_all = (&self.pose.network, &self.pose.network_card);
        let (network, card) = if it.network.is_some() { own } else { of_all };
        let network = network.as_deref().filter(|_| it.keypoints.is_none())?;
        Some((network, card.as_deref()))
    }

    /// Whether expected errors are predicted from the frames.
    pub fn has_network(&self) -> bool {
        self.quality.network.is_some()
    }

    /// Whether there are processes that send expected errors.
    pub fn has_quality(&self) -> bool {
        self.quality.table.is_some() || self.has_network()
    }

    /// How long a stage waits for a view that is late, milliseconds.
    pub fn deadline_ms(&self) -> u64 {
        self.supervise
            .deadline_ms
            .unwrap_or(match self.capture.mode {
                capture::Mode::Lossless => 10_000,
                capture::Mode::Realtime => 200,
            })
    }

    /// How long the main loop of a process may stand still before it is killed, seconds.
    pub fn hang_limit_s(&self) -> u64 {
        self.supervise
            .hang_limit_s
            .unwrap_or(match self.capture.mode {
                capture::Mode::Lossless => 120,
                capture::Mode::Realtime => 10,
            })
    }

    /// Takes every relative path as relative to `base`.
    fn resolve(&mut self, base: &Path, machine: &dyn Machine) {
        for path in [&mut self.rig, &mut self.output] {
            *path = base.join(&path);
        }
        if let Some(model) = &mut self.model {
            *model = relative_to(model, base);
        }
        for camera in &mut self.cameras {
            if !camera.source.is_empty() {
                camera.source = machine.footage(&camera.source, base);
            }
            let files = [&mut camera.keypoints, &mut camera.network_card];
            for file in files.into_iter().flatten() {
                *file = base.join(&file);
            }
            if let Some(network) = &mut camera.network {
                *network = relative_to(network, base);
            }
        }
        self.link.resolve(base);
        let quality = &mut self.quality;
        let files = [&mut quality.table, &mut quality.onnx_runtime];
        for file in files.into_iter().flatten() {
            *file = base.join(&file);
        }
        let may_ship = [&mut quality.network, &mut self.fuse.consistency];
        for file in may_ship.into_iter().flatten() {
            *file = relative_to(file, base);
        }
        let pose = &mut self.pose;
        pose.network = pose.network.take().filter(|it| !is_none(it));
        if let Some(network) = &mut pose.network {
            *network = relative_to(network, base);
        }
        let files = [
            &mut pose.network_card,
            &mut pose.detector,
            &mut pose.detector_card,
            &mut pose.onnx_runtime,
        ];
        for file in files.into_iter().flatten() {
            *file = base.join(&file);
        }
        pose.springs = relative_to(&pose.springs, base);
        if !is_none(&self.pose.orientation) {
            self.pose.orientation = relative_to(&self.pose.orientation, base);
        }
        let joint_map = &mut self.triangulate.joint_map;
        if !is_none(joint_map) {
            *joint_map = relative_to(joint_map, base);
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
