//! `parallax config`: shows and checks deployment files.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};
use deployment::Entry;
use failure::{ExitKind, Failure, OrFail as _};
use launch::{load, plan};
use serde_json::json;
use terminal::output;

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Print every setting with its value, meaning and origin.
    Show(Arguments),
    /// Check the file, and check that its inputs can be read.
    Check(Arguments),
    /// Print the JSON schema of deployment files, for editors.
    #[command(after_help = SCHEMA_HELP)]
    Schema,
    /// Print every key with its type and meaning.
    Keys(Keys),
}

const SCHEMA_HELP: &str = "\
The schema (JSON Schema, draft 2020-12) lets an editor complete and explain the keys of a deployment file, and mark unknown
keys. `config check` finds other mistakes, such as values that contradict each other.

For VS Code with \"Even Better TOML\", and other editors that use taplo:
    parallax config schema > parallax.schema.json
and as the first line of the deployment file:
    #:schema ./parallax.schema.json";

/// Options of `config keys`.
#[derive(Debug, Args)]
pub(crate) struct Keys {
    /// Print the settings reference in Markdown, with one table per section.
    #[arg(long)]
    markdown: bool,
}

/// Options of `config show` and `config check`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The deployment file.
    file: Option<PathBuf>,
    /// Replace a value, for example `--set capture.scale=0.5`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the subcommand.
pub(crate) fn run(command: &Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Show(it) => show(it),
        Command::Check(it) => check(it),
        Command::Schema => schema(),
        Command::Keys(it) => keys(it),
    }
}

fn schema() -> Result<ExitCode, Failure> {
    output::json(&deployment::schema())?;
    Ok(ExitCode::SUCCESS)
}

fn keys(arguments: &Keys) -> Result<ExitCode, Failure> {
    if arguments.markdown {
        let reference = deployment::reference().or_fail(ExitKind::Run)?;
        output::line(reference.trim_end())?;
        return Ok(ExitCode::SUCCESS);
    }
    for key in deployment::keys() {
        output::line(format_args!("{}: {}", key.name, key.takes))?;
        output::line(format_args!("    {}", key.meaning))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn show(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let loaded = match &arguments.file {
        Some(file) => load::read(file, &arguments.set)?,
        None => load::defaults(&arguments.set)?,
    };
    let mut entries = loaded.entries().or_fail(ExitKind::Run)?;
    let method = loaded.deployment.method;
    entries.retain(|entry| method.has(&entry.key));
    for entry in &mut entries {
        entry.change_texts(footage::without_passwords);
    }
    if arguments.json {
        output::json(&json!({ "schema_version": 1, "file": arguments.file, "keys": entries }))?;
    } else {
        for text in document(&entries) {
            output::line(text)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the lines of a complete deployment file, with the origin of every value.
fn document(entries: &[Entry]) -> Vec<String> {
    let mut lines = Vec::new();
    let mut section = "";
    let of_size = |entry: &&Entry| ["capture.size", "capture.scale"].contains(&entry.key.as_str());
    let is_by_itself = entries.iter().filter(of_size).all(|entry| entry.value.is_none());
    for entry in entries {
        let (of, name) = entry.key.split_once('.').unwrap_or(("", &entry.key));
        if of != section {
            lines.extend([String::new(), format!("[{of}]")]);
            section = of;
        }
        lines.push(format!("# {}", entry.meaning));
        lines.push(match &entry.value {
            Some(value) => format!("{name} = {value}  # {}", entry.origin.name()),
            None if entry.key == "capture.scale" && is_by_itself => {
                format!("# a run chooses {name} automatically: `run --dry-run` shows the value")
            }
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
    let loaded = load::read(file, &arguments.set)?;
    let report = plan::check(&loaded.deployment)?;
    if arguments.json {
        output::json(&json!({ "schema_version": 1, "file": file, "ok": true }))?;
    } else {
        output::line(format_args!("{}: ok, {report}", file.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
