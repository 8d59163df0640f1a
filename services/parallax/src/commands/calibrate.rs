//! `parallax calibrate`: cameras calibrated from what they see. One file a subcommand.

mod people;
mod refine;
mod walk;

use std::process::ExitCode;

use clap::Subcommand;
use runtime::Failure;

use crate::globals::Globals;

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find where the cameras of a deployment stand, from people walking about.
    People(Box<people::Arguments>),
    /// Make a rig better by a recording, or put it right after a camera was moved.
    Refine(Box<refine::Arguments>),
}

/// Runs the subcommand.
pub(crate) fn run(command: &Command, globals: Globals) -> Result<ExitCode, Failure> {
    match command {
        Command::People(it) => people::run(it, globals),
        Command::Refine(it) => refine::run(it, globals),
    }
}
