//! Options and limits of the demo.

use std::path::PathBuf;

use scene::Action;

/// Options of the demo.
#[derive(Debug, Clone)]
pub struct Options {
    /// The folder for the report and the run.
    pub out: PathBuf,
    /// Number of frames per camera. By default, it is the number of frames in `seconds` or, if that is not given, in twenty seconds, but at
    /// least 30.
    pub frames: Option<u64>,
    /// Duration of the run, in seconds; ignored if `frames` is given.
    pub seconds: Option<u32>,
    /// Frames per second. By default, as many as this machine can process, but at most 5.
    pub rate_hz: Option<f64>,
    /// The action of the person.
    pub action: Action,
    /// Number of the person, which determines body shape and clothes.
    pub subject: u64,
    /// Number of people: the person of `action` and `subject`, and others who cross the room.
    pub people: u64,
    /// Seed of the motion, the room and the lighting.
    pub seed: u64,
    /// Time that a stage waits for a late view, in milliseconds; by default 500, or more on a slow machine.
    pub deadline_ms: Option<u64>,
    /// True to kill a camera's process.
    pub kills: bool,
    /// Configurable limits.
    pub limits: Limits,
    /// The name of the deployment, unique among those that run at the same time.
    pub name: String,
}

/// Configurable limits.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Smallest percentage of frames that must have a result.
    pub min_results: f64,
    /// Smallest percentage of results that must have a skeleton.
    pub min_skeletons: f64,
    /// Smallest PCP3D at gamma 0.5 over all results, in percent.
    pub min_pcp3d: f64,
    /// Longest time until a result uses a frame of the killed camera again, in milliseconds, on a machine that can process 5 frames per
    /// second.
    pub max_return_ms: f64,
    /// Longest pause between results while the killed camera is missing, in milliseconds, on a machine that can process 5 frames per
    /// second.
    pub max_pause_ms: f64,
}
