//! `parallax messages`: prints the layout of messages, for programs in other languages.

mod json;
mod table;

use std::process::ExitCode;

use clap::Args;
use failure::Failure;
use terminal::output;

/// Options of `parallax messages`.
#[derive(Debug, Args)]
#[command(after_help = "\
Shared memory and recordings contain messages as these structs. Python users do not need the layout: see python/README.md.

Examples:
    parallax messages --json                        print structs, topics, versions and limits
    parallax messages                               print topics and their versions")]
pub(crate) struct Arguments {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Prints the layout.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    if arguments.json {
        output::line(json::json().trim_end())?;
    } else {
        for topic in table::topics() {
            output::line(format_args!("{:<20} {}", topic.name, topic.message))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
