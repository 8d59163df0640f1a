//! `parallax messages`: the layout of messages, for programs in other languages.

use std::process::ExitCode;

use clap::Args;
use failure::Failure;
use terminal::output;

/// Options of `parallax messages`.
#[derive(Debug, Args)]
#[command(after_help = "\
Messages lie in shared memory, and in recordings, as these structs. A header of C checks itself: a compiler that lays them
out otherwise refuses it. Python needs neither: see python/README.md.

Examples:
    parallax messages --c > parallax_messages.h     structs, topics, versions, limits; C11 or C++11
    parallax messages --json                        the same for languages that build types as they run
    parallax messages                               topics and their versions")]
pub(crate) struct Arguments {
    /// Print a C header.
    #[arg(long)]
    c: bool,
    /// Print JSON.
    #[arg(long, conflicts_with = "c")]
    json: bool,
}

/// Prints the layout.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    if arguments.c {
        output::line(layouts::c_header().trim_end())?;
    } else if arguments.json {
        output::line(layouts::json().trim_end())?;
    } else {
        for topic in layouts::topics() {
            output::line(format_args!("{:<20} {}", topic.name, topic.message))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
