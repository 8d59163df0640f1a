//! What is to be tried, and what must hold.

use std::path::PathBuf;

use super::scenario::Scenario;

/// What to try.
#[derive(Debug, Clone)]
pub struct Options {
    /// The deployment file; four cameras that do not exist if there is none.
    pub deployment: Option<PathBuf>,
    /// What is to happen; everything that the deployment has processes for if empty.
    pub scenarios: Vec<Scenario>,
    /// Chooses the victims, and the performance of the person who does not exist.
    pub seed: u64,
    /// Footage of every run, seconds.
    pub seconds: u32,
    /// Seconds of a run in which one process after the other is killed that are reported together.
    pub part_seconds: u32,
    /// Folder for the report and the results.
    pub out: PathBuf,
    /// Name of the deployment while it is tried; its own and `-chaos` if there is none.
    pub name: Option<String>,
    /// Limits that can be asked for.
    pub limits: Limits,
}

/// Limits that can be asked for.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Longest time from the kill until the process has a part in a result again (or, of those that no result names,
    /// until it has done something), milliseconds.
    pub max_return_ms: f64,
    /// Longest time without a result while a process is away without which others can go on, milliseconds.
    pub max_pause_ms: f64,
}
