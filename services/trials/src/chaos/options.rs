//! Options and limits of the scenarios.

use std::path::PathBuf;

use super::scenario::Scenario;

/// Options of a fault-injection trial.
#[derive(Debug, Clone)]
pub struct Options {
    /// The deployment file; four synthetic cameras if there is none.
    pub deployment: Option<PathBuf>,
    /// The scenarios; if empty, all that are possible with the processes of the deployment.
    pub scenarios: Vec<Scenario>,
    /// Seed of the choice of processes and cameras, and of the synthetic scene.
    pub seed: u64,
    /// Length of the footage of every run, seconds.
    pub seconds: u32,
    /// Length of the parts in which a run with random kills is reported, seconds.
    pub part_seconds: u32,
    /// The folder for the report and the results.
    pub out: PathBuf,
    /// The name of the deployment during the trial; its own name with `-chaos` appended if there is none.
    pub name: Option<String>,
    /// Configurable limits.
    pub limits: Limits,
}

/// Configurable limits.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// The longest time from the fault until the process contributes to a result again, milliseconds. For processes that
    /// results do not name: until it reports that it has worked.
    pub max_return_ms: f64,
    /// The longest pause between results while a process is away that the others do not depend on, milliseconds.
    pub max_pause_ms: f64,
}
