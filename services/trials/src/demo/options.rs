//! What is to be shown, and what must hold.

use std::path::PathBuf;

use scene::Action;

/// What to show.
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder for the report and all that it is made of.
    pub out: PathBuf,
    /// Frames of every camera; those of `seconds`, or of twenty seconds but at least 30, if there is no number.
    pub frames: Option<u64>,
    /// How long the cameras run, seconds; `frames` goes before it.
    pub seconds: Option<u32>,
    /// Frames a second; what this machine is found to be able to, at most 5, if there is no number.
    pub rate_hz: Option<f64>,
    /// What the person does.
    pub action: Action,
    /// Number of the person: shape, clothes, manners.
    pub subject: u64,
    /// Seed of the performance, the room and the lamps.
    pub seed: u64,
    /// How long a stage waits for a view that is late, milliseconds; 500, or what this machine needs, if there is no
    /// number.
    pub deadline_ms: Option<u64>,
    /// Whether the process of a camera is killed.
    pub kills: bool,
    /// Limits that can be asked for.
    pub limits: Limits,
    /// Name of the deployment: two that run at once need two.
    pub name: String,
}

/// Limits that can be asked for.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Least share of the frames with a result, percent; slow machines pass frames over, which is counted.
    pub min_results: f64,
    /// Least share of the results with a skeleton, percent.
    pub min_skeletons: f64,
    /// Least PCP3D at gamma 0.5 over all results, percent.
    pub min_pcp3d: f64,
    /// Longest time until the killed camera has a frame in a result again, milliseconds on a machine that keeps up
    /// with 5 frames a second.
    pub max_return_ms: f64,
    /// Longest time without a result while the killed camera is away, milliseconds on a machine that keeps up with
    /// 5 frames a second.
    pub max_pause_ms: f64,
}
