//! `parallax service`: become one process of a deployment.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, ValueEnum};
use deployment::Stage;
use launch::process;
use runtime::{ExitKind, Failure, Launch, OrFail as _, run_service};

use crate::stage;

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
    Results,
    /// Every message into one file.
    Record,
    /// What a recording holds of another process.
    Replay,
}

/// Which process.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Which process to become.
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

impl Name {
    fn process(self) -> process::Name {
        match self {
            Self::Capture => process::Name::Capture,
            Self::Pose => process::Name::Pose,
            Self::Quality => process::Name::Quality,
            Self::Fuse => process::Name::Fuse,
            Self::Triangulate => process::Name::Triangulate,
            Self::Results => process::Name::Results,
            Self::Record => process::Name::Record,
            Self::Replay => process::Name::Replay,
        }
    }
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
    let name = arguments.name.process();
    Ok(run_service(launch, |service| {
        process::become_it(service, name, &own)
    }))
}
