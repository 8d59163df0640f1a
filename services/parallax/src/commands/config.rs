//! `parallax config`: what a deployment file says, and whether it can be used.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use runtime::{ExitKind, Failure, OrFail as _};
use serde_json::json;

use crate::deployment::{Entry, Loaded};

use crate::{inputs, output};

/// What to do with a deployment file.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Print every value, what it means, and who said it.
    Show(Arguments),
    /// Check the file, and that what it names can be read.
    Check(Arguments),
}

/// Which deployment file.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The deployment file.
    file: Option<PathBuf>,
    /// Replace a value, for example `--set fuse.workers=2`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Shows or checks.
pub(crate) fn run(command: &Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Show(it) => show(it),
        Command::Check(it) => check(it),
    }
}

fn show(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let loaded = match &arguments.file {
        Some(file) => Loaded::read(file, &arguments.set)?,
        None => Loaded::defaults(&arguments.set)?,
    };
    let entries = loaded.entries().or_fail(ExitKind::Run)?;
    if arguments.json {
        output::json(&json!({ "schema_version": 1, "file": arguments.file, "keys": entries }))?;
    } else {
        for text in document(&entries) {
            output::line(text)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The entries as a deployment file that says everything, with the origin of every value.
fn document(entries: &[Entry]) -> Vec<String> {
    let mut lines = Vec::new();
    let mut section = "";
    for entry in entries {
        let (of, name) = entry.key.split_once('.').unwrap_or(("", entry.key));
        if of != section {
            lines.extend([String::new(), format!("[{of}]")]);
            section = of;
        }
        lines.push(format!("# {}", entry.meaning));
        lines.push(match &entry.value {
            Some(value) => format!("{name} = {value}  # {}", entry.origin.name()),
            None => format!("# {name} is not set"),
        });
    }
    lines
}

fn check(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let file = arguments
        .file
        .as_ref()
        .ok_or("config check needs a deployment file")
        .or_fail(ExitKind::Usage)?;
    let loaded = Loaded::read(file, &arguments.set)?;
    let report = inputs::check(&loaded.deployment)?;
    if arguments.json {
        output::json(&json!({ "schema_version": 1, "file": file, "ok": true }))?;
    } else {
        output::line(format_args!("{}: ok, {report}", file.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
