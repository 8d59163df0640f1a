//! `parallax chaos`: injects faults into a deployment, one run per fault, and checks limits.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure};
use terminal::{Globals, output};
use trials::chaos::{self, Options, Scenario};

const HELP: &str = "\
Each scenario is a separate run with real processes and a real fault. --list lists the scenarios. Without a DEPLOYMENT, \
the four synthetic cameras of `parallax demo` are used. A DEPLOYMENT keeps its mode, pace, deadline and hang limit. \
Its own results are not touched: each scenario writes to OUT/<scenario>. The DEPLOYMENT itself may run at the same time, \
because the trial uses the name <name>-chaos.

When a process is killed, the following limits apply. Its death is noticed within a second. The process is back within \
--max-return-ms. If the other processes do not depend on it, no pause between two results is longer than --max-pause-ms. \
Every frame of every view is accounted for, except two frames that the process may have been processing. No other process \
fails. The run ends on its own. Nothing is left in shared memory.

hang-...: a process is stopped. This is noticed within three heartbeats (450 ms, or \
supervise.missed_beats of the deployment) plus a second. The time of the heartbeats is added to --max-return-ms.

spin-...: a process enters an endless loop. It sends heartbeats, but makes no progress. With realtime delivery, this is noticed \
when an iteration has taken as much processor time as three heartbeats (450 ms), and three times as much as any earlier frame. With lossless \
delivery, it is noticed when the main loop has made no progress for three seconds. The scenario sets this limit (supervise.hang_limit_s).

kill-random: processes chosen at random are killed. Every killed process comes back, and 99 of 100 do so within --max-return-ms. \
In a long run, memory may grow from start to end by a tenth plus 32 MB, compared at equal ages of the processes. Descriptors \
and files may grow by a tenth plus 8. A run is long if it has nine samples, a second apart, at which all processes worked. \
A run longer than --part-seconds is also reported in parts.

kill-supervisor: the supervisor is killed. Its processes end within a second. The next start of the same deployment removes \
the leftovers, and succeeds.

camera-...: a camera fails for a fifth of the footage, as with `fault` in a deployment. The camera's frames have the status of \
the fault, and results from the other cameras continue (--max-pause-ms). The camera is used in results again within --max-return-ms.

camera-moved: one camera of the rig is rotated by two degrees. This camera must be identified, and no other. \
The scenario needs four cameras and some seconds of results.

stall-results: the process `results` is stopped for three seconds, then resumed. With realtime delivery, results continue at half \
the rate or more. With lossless delivery, nothing is lost.

cut-link and kill-host (only in builds with the feature hosts): the deployment runs as two hosts on this machine, connected by a relay. \
Each host has half of the cameras. The relay is cut for three seconds, or the host with cameras is killed and restarted. The other host \
must notice this, use the views again within --max-return-ms, and account for every frame of these views. Both scenarios need a \
DEPLOYMENT in real time with a rate and four cameras.

A process is back when it has sent its first message that contributes to a result. Results do not name the processes fuse, quality and \
results. These are back when they report that they have worked. During the trial, the number of restarts is not limited \
(supervise.max_restarts), and no overlays are drawn.

The report is written to OUT/chaos.json. --json also prints it.

Exit codes: 0 all limits were met; 6 a limit was exceeded (the table says which); 1 the trial failed; 2 the command line is \
wrong; 130 stopped by Ctrl-C.

Examples:
    parallax chaos
    parallax chaos --scenario kill-pose,kill-supervisor
    parallax chaos my.toml --scenario kill-random --seconds 600 --seed 7 --json
    parallax chaos --scenario kill-random --seconds 7200 --part-seconds 600      # endurance";

/// Options of `parallax chaos`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// The deployment file. If not given, four synthetic cameras are used.
    deployment: Option<PathBuf>,
    /// The scenarios, separated by commas. If not given, all scenarios that the processes of the deployment allow.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = Scenario::by_name)]
    scenario: Vec<Scenario>,
    /// List the scenarios and exit.
    #[arg(long)]
    list: bool,
    /// Seed for the synthetic scene, and for the random choice of processes and cameras.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Length of the footage of every run, in seconds. On a busy machine, starting the processes uses up some of this time.
    #[arg(long, value_name = "S", default_value_t = 30, value_parser = clap::value_parser!(u32).range(4..=36_000))]
    seconds: u32,
    /// Length of the parts into which the report of kill-random divides a long run, in seconds.
    #[arg(long, value_name = "S", default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    part_seconds: u32,
    /// Folder for the report and the results.
    #[arg(long, value_name = "DIR", default_value = "out/chaos")]
    out: PathBuf,
    /// Name of the deployment during the trial. It must be unique among running deployments.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Configurable limits.
    #[command(flatten)]
    limits: Limits,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// Configurable limits.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Limits")]
struct Limits {
    /// Longest time from the fault until the process contributes to a result again, in milliseconds. For a process whose
    /// work cannot be seen in results, the time ends when the process reports that it has handled messages again.
    #[arg(long, value_name = "MS", default_value_t = 8000.0)]
    max_return_ms: f64,
    /// Longest pause between results while a process is missing, if the other processes do not need it, in milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 2000.0)]
    max_pause_ms: f64,
}

impl Arguments {
    fn options(&self) -> Options {
        Options {
            deployment: self.deployment.clone(),
            scenarios: self.scenario.clone(),
            seed: self.seed,
            seconds: self.seconds,
            part_seconds: self.part_seconds,
            out: self.out.clone(),
            name: self.name.clone(),
            limits: chaos::Limits {
                max_return_ms: self.limits.max_return_ms,
                max_pause_ms: self.limits.max_pause_ms,
            },
        }
    }
}

/// Runs the scenarios, and prints the report.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    if arguments.list {
        for it in Scenario::all() {
            output::line(format_args!("{:<17} {}", it.name(), it.summary()))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let Some(outcome) = chaos::run(&arguments.options(), globals.verbosity())? else {
        output::message("stopped: no limits were checked, and no report was written");
        return Ok(ExitCode::from(ExitKind::Interrupted.status()));
    };
    if arguments.json {
        output::json(&outcome.json)?;
    } else if !globals.quiet {
        output::line(outcome.table)?;
    }
    let status = if outcome.is_held {
        0
    } else {
        ExitKind::Limit.status()
    };
    Ok(ExitCode::from(status))
}
