//! `parallax bench latency|throughput|scale`: benchmarks of whole deployments.

use std::path::PathBuf;

use clap::Args;
use messages::MAX_VIEWS;
use trials::bench::Options;

use super::{EXITS, Output};
use terminal::rate;

const HELP: &str = "\
Each run is a deployment of real processes, started as by `parallax run`. Without a deployment file, the cameras are \
synthetic, with 320x240 pixels and `--rate` frames per second. Their pictures are rendered in advance into OUT/pictures. \
With --live, the capture processes render the pictures during the run, and compete with the other processes for the cores. The pictures \
are searched near the last pose, or everywhere with `--set paper.search=full`.

latency     --views cameras in real time; then a second run in which the last camera's process is killed
throughput  --views cameras, every frame, as fast as possible
scale       as latency, with 1, 2, ... --views cameras; then a run with all cameras in which the last one is killed

For every run, the table shows the number of results and their rate, the latency from the capture of \
the first picture to the result (end to end), the latency of every stage, and the processor \
time per result of all processes together. Times are in milliseconds. The last camera is killed at the first result, and is not \
restarted. Only results after its death are measured.

The results of each run are in the folder OUT/<run>.";

/// Options of the load benchmarks.
#[derive(Debug, Args)]
#[command(after_help = EXITS, after_long_help = format!("{HELP}\n\n{EXITS}"))]
pub(crate) struct Arguments {
    /// The deployment file. If not given, synthetic cameras are used.
    deployment: Option<PathBuf>,
    /// Number of cameras to use, beginning with the first in the deployment file. If not given, all cameras of the file are used, or 4
    /// synthetic cameras.
    #[arg(long, value_name = "N", value_parser = views)]
    views: Option<usize>,
    /// Length of the footage of every run, in seconds.
    #[arg(long, value_name = "S", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=36_000))]
    seconds: u32,
    /// Frames per second of the synthetic cameras.
    #[arg(long, value_name = "HZ", default_value_t = 5.0, value_parser = rate)]
    rate: f64,
    /// Seed of the motion, the room and the lighting.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Let the capture processes render their pictures during the run.
    #[arg(long, conflicts_with = "deployment")]
    live: bool,
    /// Let stages poll for messages, like `--set runtime.spin=true`.
    #[arg(long)]
    spin: bool,
    /// Replace a value of the deployment, for example `--set capture.scale=0.5`. May be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for pictures and results.
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    out: PathBuf,
    /// Name of the deployment. It must be unique among running deployments.
    #[arg(long, value_name = "NAME", default_value = "bench")]
    name: String,
    /// Limit on the median end-to-end latency of the run with all cameras, in milliseconds.
    #[arg(long, value_name = "MS")]
    max_p50_ms: Option<f64>,
    /// Limit on the 99th percentile of the end-to-end latency of the run with all cameras, in milliseconds.
    #[arg(long, value_name = "MS")]
    max_p99_ms: Option<f64>,
    /// Minimum number of results per second in the run with all cameras.
    #[arg(long, value_name = "HZ")]
    min_rate: Option<f64>,
    /// Output options.
    #[command(flatten)]
    pub(super) output: Output,
}

/// Parses a number of cameras.
fn views(text: &str) -> Result<usize, String> {
    let n = text.parse().ok().filter(|value| (1..=MAX_VIEWS).contains(value));
    n.ok_or_else(|| format!("expected 1 to {MAX_VIEWS}"))
}

impl Arguments {
    /// Returns the options of the benchmark.
    pub(super) fn options(&self) -> Options {
        Options {
            deployment: self.deployment.clone(),
            views: self.views,
            seconds: self.seconds,
            rate_hz: self.rate,
            seed: self.seed,
            live: self.live,
            spin: self.spin,
            set: self.set.clone(),
            out: self.out.clone(),
            name: self.name.clone(),
            max_p50_ms: self.max_p50_ms,
            max_p99_ms: self.max_p99_ms,
            min_rate_hz: self.min_rate,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_of_cameras_is_limited_to_the_maximum_of_a_deployment() {
        assert_eq!(views("16"), Ok(16));
        for wrong in ["0", "17", "-1", "four"] {
            views(wrong).unwrap_err();
        }
    }
}
