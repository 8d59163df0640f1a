//! `parallax calibrate`: cameras calibrated from what they see. One file a subcommand.

mod board;
mod misfits;
mod origin;
mod people;
mod refine;
mod walk;

use std::process::ExitCode;

use clap::Subcommand;
use failure::Failure;

pub(crate) use people::height;
use terminal::Globals;

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find lenses and places of cameras from a board that is moved about; draw boards to print.
    Board(Box<board::Arguments>),
    /// Put the origin of a rig on the floor, by a board, three points, or people who stand.
    Origin(Box<origin::Arguments>),
    /// Find the places of a deployment's cameras from people who walk about.
    People(Box<people::Arguments>),
    /// Improve a rig by a recording, or correct it after a camera was moved.
    Refine(Box<refine::Arguments>),
}

/// Runs the subcommand.
pub(crate) fn run(command: &Command, globals: Globals) -> Result<ExitCode, Failure> {
    match command {
        Command::Board(it) => board::run(it, globals),
        Command::Origin(it) => origin::run(it, globals),
        Command::People(it) => people::run(it, globals),
        Command::Refine(it) => refine::run(it, globals),
    }
}
