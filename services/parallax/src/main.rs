//! Entry point: parse the command line, then become what it names.
#![forbid(unsafe_code)]

mod cli;
mod commands;
mod deployment;
mod failure;
mod inputs;
mod output;

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    output::start_log(&cli.globals);
    match commands::run(cli) {
        Ok(code) => code,
        Err(failure) => failure.report(),
    }
}
