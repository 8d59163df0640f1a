//! `parallax-lab judge` for a detector of people.

use std::process::ExitCode;

use failure::{Console, Failure, Stop};
use lab::finding;
use terminal::output;

use super::Arguments;

/// Runs the command.
pub(super) fn run(
    arguments: &Arguments,
    stop: &Stop,
    console: &dyn Console,
) -> Result<ExitCode, Failure> {
    let detector = inputs::detector::open(&arguments.model, arguments.card.as_deref())?;
    let pictures = finding::read(&arguments.dataset)?;
    let score = finding::judge(&detector, &pictures, (stop, console))?;
    if arguments.json {
        output::json(&score)?;
    } else {
        output::line(score)?;
    }
    Ok(ExitCode::SUCCESS)
}
