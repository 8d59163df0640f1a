//! `parallax run`: a whole deployment, from footage to the summary.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use crate::cli::Globals;
use crate::deployment::Loaded;
use crate::failure::{Failing as _, Failure, Kind};

/// What to run.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The deployment file.
    config: PathBuf,
    /// Folder for the results, instead of the file's `output`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace a value, for example `--set fuse.workers=2`; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Show what would be started and how much shared memory it needs, and start nothing.
    #[arg(long)]
    dry_run: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the deployment until its footage ends, or it is told to stop.
pub(crate) fn run(arguments: &Arguments, _globals: Globals) -> Result<ExitCode, Failure> {
    let mut loaded = Loaded::read(&arguments.config, &arguments.set)?;
    if let Some(out) = &arguments.out {
        loaded.deployment.output = std::path::absolute(out).failing(Kind::Usage)?;
    }
    Ok(ExitCode::SUCCESS)
}
