//! `parallax service`: runs one process of a deployment.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser};
use deployment::Stage;
use failure::{ExitKind, Failure, OrFail as _};
use launch::process::{self, Name};
use runtime::{Launch, run_service};

use crate::stage;

/// Options of `parallax service`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The process to run.
    #[arg(value_parser = names())]
    name: Name,
    /// Arguments from the supervisor: --plan, --index, and the launch arguments.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<OsString>,
}

/// Arguments of the process itself.
#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct ServiceArguments {
    /// File of the resolved deployment. It is read if standard input is empty.
    #[arg(long)]
    plan: PathBuf,
    /// Index of the view or worker, counted from 0.
    #[arg(long, default_value_t = 0)]
    index: usize,
    /// The stage that a replay process replaces.
    #[arg(long, value_parser = stage::parser())]
    stage: Option<Stage>,
    /// For tests: in epoch 0, enter an endless loop after a message about a later frame has been sent.
    #[arg(long)]
    spin_after: Option<u64>,
}

/// Returns a parser for the names of processes, with their descriptions for `--help`.
fn names() -> impl TypedValueParser<Value = Name> {
    let values = Name::ALL.map(|name| PossibleValue::new(name.name()).help(name.help()));
    PossibleValuesParser::new(values)
        .try_map(|name| Name::of_name(&name).ok_or("there is no such process"))
}

/// Runs the process.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let (launch, rest) = Launch::from_args(arguments.rest.iter().cloned())?;
    let ServiceArguments {
        plan,
        index,
        stage,
        spin_after,
    } = ServiceArguments::try_parse_from(rest).or_fail(ExitKind::Usage)?;
    let process_arguments = process::ProcessArguments {
        plan,
        index,
        stage,
        spin_after,
    };
    Ok(run_service(launch, |service| {
        process::run(service, arguments.name, &process_arguments)
    }))
}
