//! The laboratory of Parallax: trains and evaluates models, evaluates the method, makes synthetic sequences, and predicts the
//! resources that a deployment needs. The other program, `parallax`, runs deployments.
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
