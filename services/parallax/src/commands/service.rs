//! `parallax service`: runs one process of a deployment.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser};
use deployment::Stage;
use launch::process::{self, Name};
use runtime::{ExitKind, Failure, Launch, OrFail as _, run_service};

use crate::stage;

/// Which process.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Which process to become.
    #[arg(value_parser = names())]
    name: Name,
    /// What the supervisor says: --plan, --index, and about the deployment.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    rest: Vec<OsString>,
}

/// The service's own arguments.
#[derive(Debug, Parser)]
#[command(no_binary_name = true)]
struct Own {
    /// The resolved deployment, where standard input does not hold it.
    #[arg(long)]
    plan: PathBuf,
    /// View or worker, from 0.
    #[arg(long, default_value_t = 0)]
    index: usize,
    /// What a recording stands in for.
    #[arg(long, value_parser = stage::parser())]
    stage: Option<Stage>,
    /// Compute for ever in the first life, once something of a later frame has been sent.
    #[arg(long)]
    spin_after: Option<u64>,
}

/// A parser of the names of processes, which `--help` explains.
fn names() -> impl TypedValueParser<Value = Name> {
    let values = Name::ALL.map(|it| PossibleValue::new(it.name()).help(it.help()));
    PossibleValuesParser::new(values)
        .try_map(|name| Name::of_name(&name).ok_or("there is no such process"))
}

/// Becomes the process.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let (launch, rest) = Launch::from_args(arguments.rest.iter().cloned())?;
    let Own {
        plan,
        index,
        stage,
        spin_after,
    } = Own::try_parse_from(rest).or_fail(ExitKind::Usage)?;
    let own = process::Own {
        plan,
        index,
        stage,
        spin_after,
    };
    Ok(run_service(launch, |service| {
        process::become_it(service, arguments.name, &own)
    }))
}
