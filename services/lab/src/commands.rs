//! The commands, one file each.

pub(crate) mod eval;
pub(crate) mod judge;
pub(crate) mod model;
pub(crate) mod network;
pub(crate) mod simulate;
pub(crate) mod smooth;
pub(crate) mod synth;
pub(crate) mod train;

use std::path::Path;
use std::process::ExitCode;

use clap::CommandFactory as _;
use failure::{ExitKind, Failure, OrFail as _, init_logging};
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::de::DeserializeOwned;
use terminal::completions;

use crate::cli::{Cli, Command};

/// Creates a pool of threads; one for each core if no number is given.
///
/// * `name`: beginning of the names of the threads.
fn pool(threads: Option<u16>, name: &'static str) -> Result<ThreadPool, Failure> {
    let pool = ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    let pool = pool.thread_name(move |nth| format!("{name}-{nth}"));
    pool.build().or_fail(ExitKind::Run)
}

/// Reads a settings file. Returns the defaults if no file is given.
fn read_settings<T: DeserializeOwned + Default>(file: Option<&Path>) -> Result<T, Failure> {
    let Some(file) = file else {
        return Ok(T::default());
    };
    toml::from_str(&failure::read_text(file)?)
        .map_err(|error| Failure::new(ExitKind::Config, format!("{}: {error}", file.display())))
}

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
