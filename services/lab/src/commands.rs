//! The commands, one file each.

pub(crate) mod eval;
pub(crate) mod judge;
pub(crate) mod model;
pub(crate) mod network;
pub(crate) mod simulate;
pub(crate) mod smooth;
pub(crate) mod synth;
pub(crate) mod train;

use std::process::ExitCode;

use clap::CommandFactory as _;
use failure::{Failure, init_logging};
use terminal::completions;

use crate::cli::{Cli, Command};

/// Runs the command given on the command line.
pub(crate) fn run(cli: Cli) -> Result<ExitCode, Failure> {
    init_logging("parallax-lab", cli.globals.level());
    match cli.command {
        Command::Train(command) => train::run(command, cli.globals),
        Command::Eval(arguments) => eval::run(&arguments, cli.globals),
        Command::Judge(arguments) => judge::run(&arguments, cli.globals),
        Command::Model(command) => model::run(&command),
        Command::Synth(arguments) => synth::run(&arguments, cli.globals),
        Command::Smooth(arguments) => smooth::run(&arguments),
        Command::Simulate(command) => simulate::run(&command),
        Command::Completions(arguments) => completions::run(&arguments, Cli::command()),
        Command::Man(arguments) => completions::man(&arguments, Cli::command()),
    }
}
