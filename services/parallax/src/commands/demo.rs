//! `parallax demo`: four cameras that do not exist, every process, one of them killed on purpose, and a report.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use launch::output;
use runtime::{ExitKind, Failure};
use scene::Action;
use trials::demo::{self, Options};

use super::synth::rate;
use crate::globals::Globals;

const HELP: &str = "\
Nothing is needed but this program: the pictures are made by the camera processes while they run (a person who does \
not exist, see `parallax synth --help`), the model is the one that ships. Four cameras around the person, 320x240 \
pixels, keep up with the clock. How many frames a second they take is measured first: for about two seconds frames are \
made and solved on all cores, beside whatever else runs, and computing may take half of the time between two frames, up to \
5 frames a second; a machine that is slow or busy is told so with numbers. Every stage and camera is a process of its own, as in `parallax run`. When two fifths \
of the frames have passed, the process of camera c3 is killed (SIGKILL), as a crash would: the other three go on, the \
supervisor starts it again, and it joins in at the frame that the clock is at.

What it leaves in OUT: report.html (open it in a browser: the skeleton in space, which turns, beside the truth; who \
was there when; what the killed camera cost; latency of every stage; every frame accounted for; pictures with \
skeletons), report.json (the same numbers), deployment.toml and rig.toml (`parallax run OUT/deployment.toml` runs \
them again), and run/, the results as any run leaves them. Files of an earlier demo are replaced.

It judges itself, by limits that a broken pipeline would miss: --min-results of the frames have a result, \
--min-skeletons of these a skeleton, and PCP3D of all of them is at least --min-pcp3d; the killed camera is back within \
--max-return-ms; the others gave results without it meanwhile, if it was away for longer than \
results are apart and a stage waits, with no pause longer than --max-pause-ms; what became \
of every frame of every view is known, but for two that a killed process may have held; no other process failed; all \
results were written.
Times are those of a machine that keeps up with 5 frames a second. Where the cameras take fewer, --max-return-ms is as many \
times as long as frames are farther apart (20 at most). Where a frame takes longer than 100 ms of all cores together, before the run \
or after it, --max-pause-ms, which is 20 such frames, is longer by the same factor; and a stage waits 1.5 times as long as two \
frames are apart, 500 ms at least. With --rate nothing is measured or scaled.

Exit codes: 0 all limits held; 6 a limit was missed (the report says which); 1 the run failed; 2 the command line is \
wrong; 130 stopped by Ctrl-C.

Examples:
    parallax demo
    parallax demo --seconds 60 --action boxing --subject 4 --out /tmp/boxing
    parallax demo --no-kill --json";

/// What to show.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// Folder for the report and all that it is made of.
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    out: PathBuf,
    /// Frames of every camera; those of twenty seconds, but at least 30, if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(10..=1_000_000))]
    frames: Option<u64>,
    /// How long the cameras run, seconds; instead of --frames.
    #[arg(long, value_name = "S", conflicts_with = "frames", value_parser = clap::value_parser!(u32).range(2..=36_000))]
    seconds: Option<u32>,
    /// Frames a second; what this machine is found to be able to, at most 5, if not given.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// What the person does; `parallax synth --help` names the actions.
    #[arg(long, value_name = "NAME", default_value = "walking", value_parser = action)]
    action: Action,
    /// Number of the person: shape, clothes, manners.
    #[arg(long, value_name = "N", default_value_t = 1)]
    subject: u64,
    /// Seed of the performance, the room and the lamps.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// How long a stage waits for a view that is late, milliseconds; 500, or what this machine needs, if not given.
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=60_000))]
    deadline_ms: Option<u64>,
    /// Kill no process.
    #[arg(long)]
    no_kill: bool,
    /// Limits that can be asked for.
    #[command(flatten)]
    limits: Limits,
    /// Name of the deployment: two that run at once need two.
    #[arg(long, value_name = "NAME", default_value = "demo")]
    name: String,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// Limits that can be asked for.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Limits")]
struct Limits {
    /// Least share of the frames with a result, percent; slow machines pass frames over, which is counted.
    #[arg(long, value_name = "PERCENT", default_value_t = 10.0)]
    min_results: f64,
    /// Least share of the results with a skeleton, percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 90.0)]
    min_skeletons: f64,
    /// Least PCP3D at gamma 0.5 over all results, percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 50.0)]
    min_pcp3d: f64,
    /// Longest time until the killed camera has a frame in a result again, milliseconds on a machine that keeps up
    /// with 5 frames a second.
    #[arg(long, value_name = "MS", default_value_t = 8000.0)]
    max_return_ms: f64,
    /// Longest time without a result while the killed camera is away, milliseconds on a machine that keeps up with
    /// 5 frames a second.
    #[arg(long, value_name = "MS", default_value_t = 2000.0)]
    max_pause_ms: f64,
}

/// The action of a name, for the command line.
fn action(name: &str) -> Result<Action, String> {
    let known = || Action::ALL.map(Action::name).join(", ");
    Action::by_name(name).ok_or_else(|| format!("expected one of {}", known()))
}

impl Arguments {
    fn options(&self) -> Options {
        let limits = &self.limits;
        Options {
            out: self.out.clone(),
            frames: self.frames,
            seconds: self.seconds,
            rate_hz: self.rate,
            action: self.action,
            subject: self.subject,
            seed: self.seed,
            deadline_ms: self.deadline_ms,
            kills: !self.no_kill,
            limits: demo::Limits {
                min_results: limits.min_results,
                min_skeletons: limits.min_skeletons,
                min_pcp3d: limits.min_pcp3d,
                max_return_ms: limits.max_return_ms,
                max_pause_ms: limits.max_pause_ms,
            },
            name: self.name.clone(),
        }
    }
}

/// Runs the demo, and says what it found out.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let Some(outcome) = demo::run(&arguments.options(), globals.verbosity())? else {
        output::message("stopped: nothing is judged, and no report written");
        return Ok(ExitCode::from(ExitKind::Interrupted.status()));
    };
    if arguments.json {
        output::json(&outcome.json)?;
    } else if !globals.quiet {
        output::line(outcome.text)?;
    }
    let status = if outcome.is_held {
        0
    } else {
        ExitKind::Limit.status()
    };
    Ok(ExitCode::from(status))
}
