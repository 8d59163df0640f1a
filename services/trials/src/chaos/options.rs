//! Options and limits of the scenarios.

use std::path::PathBuf;

use super::scenario::Scenario;

/// Options of a fault-injection trial.
#[derive(Debug, Clone)]
pub struct Options {
    /// Deployment file; if `None`, four synthetic cameras are used.
    pub deployment: Option<PathBuf>,
    /// Scenarios to run; if empty, all scenarios that are possible with the processes of the deployment.
    pub scenarios: Vec<Scenario>,
    /// Seed for the choice of processes and cameras, and for the synthetic scene.
    pub seed: u64,
    /// Length of the footage of every run, in seconds.
    pub seconds: u32,
    /// Length of the parts into which the report of a run with random kills is divided, in seconds.
    pub part_seconds: u32,
    /// Folder for the report and the results.
    pub out: PathBuf,
    /// Name of the deployment during the trial; if `None`, its own name with `-chaos` appended.
    pub name: Option<String>,
    /// Configurable limits.
    pub limits: Limits,
}

/// Configurable limits.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Longest time from the fault until the process contributes to a result again, in milliseconds. For a process that does not appear in
    /// results, it is the time until the process reports that it has worked.
    pub max_return_ms: f64,
    /// Longest pause between results, in milliseconds, while a process on which no other process depends is missing.
    pub max_pause_ms: f64,
}
