//! Parallax, the laboratory: trains and judges models, evaluates the method, makes synthetic sequences, and works out what a
//! deployment will take. `parallax` runs the rigs.
#![forbid(unsafe_code)]

mod cli;
mod commands;

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    if let Err(error) = failure::guard_process() {
        return failure::Failure::new(failure::ExitKind::Run, error).exit();
    }
    let cli = cli::Cli::parse();
    failure::run_command(|| commands::run(cli))
}
