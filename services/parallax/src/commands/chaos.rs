//! `parallax chaos`: a deployment with a fault made on purpose, once for every fault, and what held.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use launch::output;
use runtime::{ExitKind, Failure};
use trials::chaos::{self, Options, Scenario};

use crate::globals::Globals;

const HELP: &str = "\
Every scenario is a run of its own, with real processes and a real fault; --list names them. Without a DEPLOYMENT the \
cameras are those of `parallax demo`: four that do not exist, so nothing is needed. With one, what it says about mode, \
pace, deadline and hang limit holds; its results stay where they are, for those of every scenario go to \
OUT/<scenario>; it may run at the same time, for its name becomes <name>-chaos.

What must hold when a process is killed: its death is noticed within a second; it is back within --max-return-ms; \
where others can go on without it, no pause between two results is longer than --max-pause-ms; what became of every \
frame of every view is known, but for two that a killed process may have held; no other process failed; the run ends by \
itself; nothing is left in shared memory. A process that is stopped (hang-...) is noticed by its missing signs of life \
within three of them (450 ms, or supervise.missed_beats of the deployment) and a second, and may be away longer by that limit; \
one that computes for ever (spin-...) gives signs of life but none of work, and is noticed as soon when it has used so much \
processor time, and three times that of any frame before for one; where nothing may be lost, when its main loop has stood \
still for three seconds, which the scenario sets (supervise.hang_limit_s). With \
kill-random everything killed comes back (--max-return-ms for 99 in 100), and if the run is long enough (nine moments \
a second apart at which all processes worked) memory, descriptors and files at last exceed those at first by no more than \
a tenth, 32 MB and 8 files; a run of more than --part-seconds is also reported part by part. With kill-supervisor its \
processes end by themselves within a second, and the next start of the same deployment removes what was left, and works.

With camera-... a camera fails for a fifth of the footage (its source does what `fault` says in a deployment): frames \
are called what is wrong with them, the others' results go on (--max-pause-ms), and the camera has a part in results again within \
--max-return-ms. With camera-moved one camera of the rig is turned by two degrees: it must be named, and no other, which \
takes four cameras and some seconds of results. With stall-results the results process stands still for three seconds and is left alone: where the latest frame \
wins, results are made at no less than half the rate meanwhile; where nothing may be lost, nothing is.

`back` is when the process sent what the first result of its new life is made of; of fuse, quality and results, which no \
result names, when it gave a sign of having worked. Restarts are not limited here (supervise.max_restarts), and no \
pictures are drawn.

It leaves OUT/chaos.json, which --json prints too.

Exit codes: 0 all held; 6 something did not (the table names it); 1 it could not be tried; 2 the command line is \
wrong; 130 stopped by Ctrl-C.

Examples:
    parallax chaos
    parallax chaos --scenario kill-pose,kill-supervisor
    parallax chaos my.toml --scenario kill-random --seconds 600 --seed 7 --json
    parallax chaos --scenario kill-random --seconds 7200 --part-seconds 600      # endurance";

/// What to try.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// The deployment file; four cameras that do not exist if not given.
    deployment: Option<PathBuf>,
    /// What is to happen, separated by commas; everything that the deployment has processes for if not given.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = Scenario::by_name)]
    scenario: Vec<Scenario>,
    /// Name the scenarios, and do nothing.
    #[arg(long)]
    list: bool,
    /// Chooses the victims, and the performance of the person who does not exist.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Footage of every run, seconds; a busy machine needs some of them to start.
    #[arg(long, value_name = "S", default_value_t = 30, value_parser = clap::value_parser!(u32).range(4..=36_000))]
    seconds: u32,
    /// Seconds of a run in which one process after the other is killed that are reported together, for each such part by itself.
    #[arg(long, value_name = "S", default_value_t = 600, value_parser = clap::value_parser!(u32).range(1..))]
    part_seconds: u32,
    /// Folder for the report and the results.
    #[arg(long, value_name = "DIR", default_value = "out/chaos")]
    out: PathBuf,
    /// Name of the deployment while it is tried: two that run at once need two.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Limits that can be asked for.
    #[command(flatten)]
    limits: Limits,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

/// Limits that can be asked for.
#[derive(Debug, Clone, Copy, Args)]
#[command(next_help_heading = "Limits")]
struct Limits {
    /// Longest time from the kill until the process has a part in a result again (or, of those that no result names,
    /// until it has done something), milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 8000.0)]
    max_return_ms: f64,
    /// Longest time without a result while a process is away without which others can go on, milliseconds.
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

/// Tries everything that is asked for, and says what held.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    if arguments.list {
        for it in Scenario::all() {
            output::line(format_args!("{:<17} {}", it.name(), it.summary()))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let Some(outcome) = chaos::run(&arguments.options(), globals.verbosity())? else {
        output::message("stopped: nothing is judged, and no report written");
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
