//! `parallax bench`: how fast messages travel between processes, and how fast whole deployments are.

mod load;
mod transport;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use launch::output;
use runtime::{ExitKind, Failure};
use trials::bench::{self, Kind, Report};

use crate::globals::Globals;

/// What to measure.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Measure one hop between two processes, without a deployment.
    Transport(transport::Arguments),
    /// Measure how long a deployment takes from the picture to the result, stage by stage, and with a dead camera.
    Latency(load::Arguments),
    /// Measure how many frames a second a deployment solves when none is dropped.
    Throughput(load::Arguments),
    /// Measure the latency with one camera, two, and so on.
    Scale(load::Arguments),
    /// Become the receiving process of `transport`.
    #[command(hide = true)]
    Receive(Receiver),
}

/// What the sending process says to the other one.
#[derive(Debug, Args)]
pub(crate) struct Receiver {
    /// About the deployment.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<OsString>,
}

/// Where numbers go.
#[derive(Debug, Args)]
struct Output {
    /// Print the numbers as JSON.
    #[arg(long)]
    json: bool,
    /// Append the numbers with date, machine, commit and settings to a file, as Markdown.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

/// Exit codes of all of them.
const EXITS: &str = "\
Exit codes: 0 measured, and every limit that was asked for held; 6 a limit was missed (the report says which); 1 it \
could not be measured; 2 the command line is wrong; 3, 4, 5 the deployment or its inputs are wrong, as for `run`; \
130 stopped by Ctrl-C.";

/// Measures.
pub(crate) fn run(command: &Command, globals: Globals) -> Result<ExitCode, Failure> {
    let verbosity = globals.verbosity();
    let load = |kind: Kind, it: &load::Arguments| {
        let report = bench::load(kind, &it.options(), verbosity)?;
        publish(report, &it.output, globals)
    };
    match command {
        Command::Transport(it) => {
            let report = bench::transport(&it.options(), verbosity)?;
            publish(report, &it.output, globals)
        }
        Command::Latency(it) => load(Kind::Latency, it),
        Command::Throughput(it) => load(Kind::Throughput, it),
        Command::Scale(it) => load(Kind::Scale, it),
        Command::Receive(it) => bench::receive(&it.rest),
    }
}

/// Prints what was measured, and appends it to the record; the exit code.
///
/// * `report`: none if it was stopped.
fn publish(report: Option<Report>, to: &Output, globals: Globals) -> Result<ExitCode, Failure> {
    let Some(report) = report else {
        output::message("stopped: nothing is reported");
        return Ok(ExitCode::from(ExitKind::Interrupted.status()));
    };
    if let Some(file) = &to.record {
        report.append(file)?;
    }
    if to.json {
        output::json(&report.json())?;
    } else if !globals.quiet {
        output::line(report.text())?;
    }
    let status = if report.is_held() {
        0
    } else {
        ExitKind::Limit.status()
    };
    Ok(ExitCode::from(status))
}
