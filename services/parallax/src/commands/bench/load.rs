//! `parallax bench latency|throughput|scale`: whole deployments under load.

use std::path::PathBuf;

use clap::Args;
use messages::MAX_VIEWS;
use trials::bench::Options;

use super::{EXITS, Output};
use crate::commands::synth::rate;

const HELP: &str = "\
Every run is a deployment of real processes, as `parallax run` starts it. Without a deployment file its cameras show a \
person who does not exist, 320x240 pixels, `--rate` frames a second; the pictures are made beforehand, into OUT/pictures \
(with --live by the camera processes while they run, which then compete with the others for the cores). They are \
searched near the last pose, as the demo's are (`--set pose.search=full`: everywhere).

latency     --views cameras that keep up with the clock; then the same while the process of the last camera is dead
throughput  --views cameras, every frame, as fast as they are taken
scale       as latency with 1, 2, ... --views cameras; then with all of them, the last one dead

The table says for every run how many results there were and how many a second, how long they took from the capture of \
the first picture to the sending of the result (end to end) and in every stage, milliseconds, and how much processor \
time a result took, all processes together. A dead camera is killed at the first result and not started again; what \
is measured then begins with its death.

The numbers of a run are in its folder, OUT/<run>, as any run leaves them.";

/// What to measure.
#[derive(Debug, Args)]
#[command(after_help = EXITS, after_long_help = format!("{HELP}\n\n{EXITS}"))]
pub(crate) struct Arguments {
    /// The deployment file; cameras that do not exist if not given.
    deployment: Option<PathBuf>,
    /// Cameras; of a deployment file the first so many, all if not given. 4 of those that do not exist.
    #[arg(long, value_name = "N", value_parser = views)]
    views: Option<usize>,
    /// Footage of every run, seconds.
    #[arg(long, value_name = "S", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=36_000))]
    seconds: u32,
    /// Frames a second of cameras that do not exist.
    #[arg(long, value_name = "HZ", default_value_t = 5.0, value_parser = rate)]
    rate: f64,
    /// Seed of the performance, the room and the lamps.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Let camera processes make their pictures while they run.
    #[arg(long, conflicts_with = "deployment")]
    live: bool,
    /// Let stages look for messages without pause: `--set runtime.spin=true`.
    #[arg(long)]
    spin: bool,
    /// Replace a value of the deployment, for example `--set fuse.workers=2`; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Folder for pictures and results.
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    out: PathBuf,
    /// Name of the deployment: two that run at once need two.
    #[arg(long, value_name = "NAME", default_value = "bench")]
    name: String,
    /// Largest median end to end, milliseconds, of the run with all cameras.
    #[arg(long, value_name = "MS")]
    max_p50_ms: Option<f64>,
    /// Largest 99th percentile, likewise.
    #[arg(long, value_name = "MS")]
    max_p99_ms: Option<f64>,
    /// Least results a second, likewise.
    #[arg(long, value_name = "HZ")]
    min_rate: Option<f64>,
    /// Where numbers go.
    #[command(flatten)]
    pub(super) output: Output,
}

/// A number of cameras, for the command line.
fn views(text: &str) -> Result<usize, String> {
    let n = text.parse().ok().filter(|it| (1..=MAX_VIEWS).contains(it));
    n.ok_or_else(|| format!("expected 1 to {MAX_VIEWS}"))
}

impl Arguments {
    /// What is to be measured.
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
    fn a_number_of_cameras_is_one_that_a_deployment_may_have() {
        assert_eq!(views("16"), Ok(16));
        for wrong in ["0", "17", "-1", "four"] {
            views(wrong).unwrap_err();
        }
    }
}
