//! `parallax bench`: benchmarks of the transport between processes, of whole deployments, and of the GPU.

mod gpu;
mod load;
mod transport;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use failure::{ExitKind, Failure};
use terminal::{Globals, output};
use trials::bench::{self, Kind, Report};

/// The benchmark to run.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Measure the transfer of a message between two processes (one hop), without a deployment.
    Transport(transport::Arguments),
    /// Measure the latency of a deployment from picture to result, stage by stage, including after a camera has died.
    Latency(load::Arguments),
    /// Measure how many frames per second a deployment processes if no frame is dropped.
    Throughput(load::Arguments),
    /// Measure the latency with one camera, two cameras, and so on.
    Scale(load::Arguments),
    /// Measure how fast the filters search frames, on the GPU and on the processor.
    Gpu(gpu::Arguments),
    /// Run the receiving process of `transport`.
    #[command(hide = true)]
    Receive(Receiver),
}

/// Arguments of the receiving process.
#[derive(Debug, Args)]
pub(crate) struct Receiver {
    /// Launch arguments, passed by the sending process.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<OsString>,
}

/// Output options of all benchmarks.
#[derive(Debug, Args)]
struct Output {
    /// Print the numbers as JSON.
    #[arg(long)]
    json: bool,
    /// Append the numbers to a Markdown file, with date, machine, commit and settings.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

/// The exit codes of all benchmarks.
const EXITS: &str = "\
Exit codes: 0 measured, and within all given limits; 6 a limit was exceeded (the report says which); 1 the measurement \
failed; 2 the command line is wrong; 3, 4, 5 the deployment or its inputs are wrong, as for `run`; \
130 stopped by Ctrl-C.";

/// Runs the benchmark.
pub(crate) fn run(command: &Command, globals: Globals) -> Result<ExitCode, Failure> {
    let verbosity = globals.verbosity();
    let load = |kind: Kind, arguments: &load::Arguments| {
        let report = bench::load(kind, &arguments.options(), verbosity)?;
        publish(report, &arguments.output, globals)
    };
    match command {
        Command::Transport(it) => {
            let report = bench::transport(&it.options(), verbosity)?;
            publish(report, &it.output, globals)
        }
        Command::Gpu(it) => {
            let report = bench::gpu(&it.options(), verbosity)?;
            publish(Some(report), &it.output, globals)
        }
        Command::Latency(it) => load(Kind::Latency, it),
        Command::Throughput(it) => load(Kind::Throughput, it),
        Command::Scale(it) => load(Kind::Scale, it),
        Command::Receive(it) => bench::receive(&it.rest),
    }
}

/// Prints the report, appends it to the file of measurements, and returns the exit code.
///
/// * `report`: `None` if the benchmark was interrupted.
fn publish(report: Option<Report>, to: &Output, globals: Globals) -> Result<ExitCode, Failure> {
    let Some(report) = report else {
        output::message("stopped: no report was written");
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
