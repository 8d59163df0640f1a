//! `parallax bench`: how fast messages travel between processes, and how fast whole deployments are.

mod course;
mod hop;
mod load;
mod occasion;
mod pictures;
mod receiver;
mod report;
mod transport;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use runtime::Failure;

use crate::globals::Globals;
use load::Kind;

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
    Receive(receiver::Arguments),
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
    match command {
        Command::Transport(it) => transport::run(it, globals),
        Command::Latency(it) => load::run(Kind::Latency, it, globals),
        Command::Throughput(it) => load::run(Kind::Throughput, it, globals),
        Command::Scale(it) => load::run(Kind::Scale, it, globals),
        Command::Receive(it) => receiver::run(it),
    }
}
