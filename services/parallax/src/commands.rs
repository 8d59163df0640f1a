//! The commands, one file each.

pub(crate) mod bench;
pub(crate) mod calib;
pub(crate) mod calibrate;
pub(crate) mod cameras;
pub(crate) mod chaos;
pub(crate) mod config;
pub(crate) mod demo;
pub(crate) mod deployments;
pub(crate) mod detect;
pub(crate) mod doctor;
pub(crate) mod export;
pub(crate) mod hosts;
pub(crate) mod messages;
pub(crate) mod new;
pub(crate) mod publish;
pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod run;
pub(crate) mod service;
pub(crate) mod smooth;
pub(crate) mod sync;
pub(crate) mod top;
pub(crate) mod view;

use std::process::ExitCode;

use clap::CommandFactory as _;
use failure::{Failure, init_logging};
use terminal::completions;

use crate::cli::{Cli, Command};

/// Runs the command that the command line names.
pub(crate) fn run(cli: Cli) -> Result<ExitCode, Failure> {
    let has_own_logging = matches!(
        cli.command,
        Command::Service(_) | Command::Bench(bench::Command::Receive(_))
    );
    if !has_own_logging {
        init_logging("parallax", cli.globals.level());
    }
    match cli.command {
        Command::Demo(it) => demo::run(&it, cli.globals),
        Command::Chaos(it) => chaos::run(&it, cli.globals),
        Command::Bench(it) => bench::run(&it, cli.globals),
        Command::Run(it) => run::run(&it, cli.globals),
        Command::Record(it) => record::run(&it, cli.globals),
        Command::Replay(it) => replay::run(&it, cli.globals),
        Command::Export(it) => export::run(&it, cli.globals),
        Command::Detect(it) => detect::run(&it),
        Command::New(it) => new::run(&it, cli.globals),
        Command::Calib(it) => calib::run(&it),
        Command::Calibrate(it) => calibrate::run(&it, cli.globals),
        Command::Cameras(it) => cameras::run(&it),
        Command::Config(it) => config::run(&it),
        Command::Messages(it) => messages::run(&it),
        Command::Publish(it) => publish::run(&it, cli.globals),
        Command::Status(it) => deployments::status(&it),
        Command::Top(it) => top::run(&it),
        Command::View(it) => view::run(&it, cli.globals),
        Command::Clean(it) => deployments::clean(&it),
        Command::Smooth(it) => smooth::run(&it, cli.globals),
        Command::Hosts(it) => hosts::run(&it),
        Command::Sync(it) => sync::run(&it, cli.globals),
        Command::Doctor(it) => doctor::run(&it),
        Command::Completions(it) => completions::run(&it, Cli::command()),
        Command::Man(it) => completions::man(&it, Cli::command()),
        Command::Service(it) => service::run(&it),
    }
}
