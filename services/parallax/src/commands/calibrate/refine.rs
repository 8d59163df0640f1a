//! `parallax calibrate refine`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use runtime::{ExitKind, Failure};

use crate::globals::Globals;

/// Options.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The deployment file.
    config: PathBuf,
}

pub(super) fn run(arguments: &Arguments, _globals: Globals) -> Result<ExitCode, Failure> {
    let message = format!("{}: not possible yet", arguments.config.display());
    Err(Failure::new(ExitKind::Usage, message))
}
