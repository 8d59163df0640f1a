//! Options and limits of the demo.

use std::path::PathBuf;

use scene::Action;

/// Options of the demo.
#[derive(Debug, Clone)]
pub struct Options {
    /// The folder for the report and the run.
    pub out: PathBuf,
    /// Frames per camera; by default those of `seconds`, or else of twenty seconds, at least 30.
    pub frames: Option<u64>,
    /// Duration of the run, seconds; ignored if `frames` is given.
    pub seconds: Option<u32>,
    /// Frames per second; by default as many as this machine can process, at most 5.
    pub rate_hz: Option<f64>,
    /// The action of the person.
    pub action: Action,
    /// The number of the person, which determines shape and clothes.
    pub subject: u64,
    /// Seed of the motion, the room and the lighting.
    pub seed: u64,
    /// How long a stage waits for a late view, milliseconds; by default 500, or more on a slow machine.
    pub deadline_ms: Option<u64>,
    /// True if a camera's process is killed.
    pub kills: bool,
    /// Configurable limits.
    pub limits: Limits,
    /// The name of the deployment, unique among those that run at the same time.
    pub name: String,
}

/// Configurable limits.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// The least share of frames with a result, percent.
    pub min_results: f64,
    /// The least share of results with a skeleton, percent.
    pub min_skeletons: f64,
    /// The least PCP3D at gamma 0.5 over all results, percent.
    pub min_pcp3d: f64,
    /// The longest time until a frame of the killed camera is used in a result again, milliseconds, on a machine that
    /// keeps up with 5 frames per second.
    pub max_return_ms: f64,
    /// The longest pause between results while the killed camera is away, milliseconds, on a machine that keeps up with
    /// 5 frames per second.
    pub max_pause_ms: f64,
}
