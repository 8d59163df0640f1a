//! What is to be measured of a deployment under load, and what must hold.

use std::path::PathBuf;

/// What to measure.
#[derive(Debug, Clone)]
pub struct Options {
    /// The deployment file; cameras that do not exist if there is none.
    pub deployment: Option<PathBuf>,
    /// Cameras; of a deployment file the first so many, all if there is no number. 4 of those that do not exist.
    pub views: Option<usize>,
    /// Footage of every run, seconds.
    pub seconds: u32,
    /// Frames a second of cameras that do not exist.
    pub rate_hz: f64,
    /// Seed of the performance, the room and the lamps.
    pub seed: u64,
    /// Whether camera processes make their pictures while they run.
    pub live: bool,
    /// Whether stages look for messages without pause.
    pub spin: bool,
    /// Values of the deployment that are replaced: `key=value`.
    pub set: Vec<String>,
    /// Folder for pictures and results.
    pub out: PathBuf,
    /// Name of the deployment: two that run at once need two.
    pub name: String,
    /// Largest median end to end, milliseconds, of the run with all cameras.
    pub max_p50_ms: Option<f64>,
    /// Largest 99th percentile, likewise.
    pub max_p99_ms: Option<f64>,
    /// Least results a second, likewise.
    pub min_rate_hz: Option<f64>,
}
