//! Entry point: parse the command line, then become what it names.
#![forbid(unsafe_code)]

mod audience;
mod budget;
mod claim;
mod cli;
mod commands;
mod deployment;
mod describe;
mod exit;
mod globals;
mod inputs;
mod judged;
mod live;
mod nothing;
mod output;
mod padding;
mod plan;
mod prepare;
mod sanity;
mod scheduling;
mod search;
mod sheet;
mod shipped;
mod spread;
mod summary;
mod taped;
mod trial;
mod vertical;
mod views;

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    if let Err(error) = runtime::guard_process() {
        return runtime::Failure::new(runtime::ExitKind::Run, error).exit();
    }
    let cli = cli::Cli::parse();
    runtime::run_command(|| commands::run(cli))
}
