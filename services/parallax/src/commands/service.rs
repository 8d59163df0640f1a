//! `parallax service`: become one process of a deployment.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};

use crate::cli::Globals;
use crate::failure::Failure;

/// The processes of a deployment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Name {
    /// One a view: footage to frames.
    Capture,
    /// One a view: frames to candidates and evidence.
    Pose,
    /// One a view: expected errors.
    Quality,
    /// One a worker: pairs of views.
    Fuse,
    /// Joints in the world.
    Triangulate,
    /// The output folder.
    Record,
}

/// Which process.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Which process to become.
    name: Name,
    /// The deployment file, resolved: absolute paths, every value.
    #[arg(long)]
    deployment: PathBuf,
    /// View or worker, from 0.
    #[arg(long, default_value_t = 0)]
    index: usize,
    /// Run of the deployment.
    #[arg(long)]
    session: u64,
    /// How often this process has been restarted.
    #[arg(long, default_value_t = 0)]
    epoch: u32,
}

/// Becomes the process.
pub(crate) fn run(_arguments: &Arguments, _globals: Globals) -> Result<ExitCode, Failure> {
    Ok(ExitCode::SUCCESS)
}
