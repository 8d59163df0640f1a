//! Options and limits of the load benchmarks.

use std::path::PathBuf;

/// Options of a load benchmark.
#[derive(Debug, Clone)]
pub struct Options {
    /// The deployment file; if `None`, synthetic cameras are used.
    pub deployment: Option<PathBuf>,
    /// Number of cameras to use, starting with the first in the deployment file. By default, all cameras are used, or four synthetic ones.
    pub views: Option<usize>,
    /// Length of the footage of every run, in seconds.
    pub seconds: u32,
    /// Frames per second of synthetic cameras.
    pub rate_hz: f64,
    /// Seed of the motion, the room and the lighting.
    pub seed: u64,
    /// True if the capture processes render their pictures during the run.
    pub live: bool,
    /// True if stages poll for messages.
    pub spin: bool,
    /// `key=value` pairs that replace values of the deployment.
    pub set: Vec<String>,
    /// The folder for pictures and results.
    pub out: PathBuf,
    /// The name of the deployment, unique among those that run at the same time.
    pub name: String,
    /// Largest median of the end-to-end latency in the run with all cameras, in milliseconds.
    pub max_p50_ms: Option<f64>,
    /// Largest 99th percentile of the end-to-end latency in the run with all cameras, in milliseconds.
    pub max_p99_ms: Option<f64>,
    /// Smallest rate of results in the run with all cameras, per second.
    pub min_rate_hz: Option<f64>,
}
