//! `parallax calibrate`: calibrates cameras from their footage. Each subcommand has its own file.

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
    /// Find lenses and poses of cameras from a board that is moved around, or draw a board to print.
    Board(Box<board::Arguments>),
    /// Move the origin of a rig to the floor, using a board, three points, or people who stand on it.
    Origin(Box<origin::Arguments>),
    /// Find the poses of a deployment's cameras from people walking about.
    People(Box<people::Arguments>),
    /// Improve a rig with footage of a person, or correct it after a camera was moved.
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
