//! Data to standard output, messages to standard error.

use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};

use runtime::{ExitKind, Failure, OrFail as _};
use serde::Serialize;
use tracing::Level;

/// How much is said to people.
#[derive(Debug, Clone, Copy)]
pub struct Verbosity {
    /// Nothing but what went wrong.
    pub quiet: bool,
    /// The least important events that are logged, here and by processes that are started.
    pub level: Level,
}

/// Writes a line of data. A reader that went away (`| head`) is no failure.
///
/// # Errors
///
/// Standard output cannot be written to.
pub fn line(text: impl Display) -> Result<(), Failure> {
    match writeln!(io::stdout().lock(), "{text}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::new(ExitKind::Run, error))
        }
        _ => Ok(()),
    }
}

/// Writes a value as one line of JSON.
///
/// # Errors
///
/// Standard output cannot be written to, or the value has no form in JSON.
pub fn json(value: &impl Serialize) -> Result<(), Failure> {
    line(serde_json::to_string(value).or_fail(ExitKind::Run)?)
}

/// Writes a message for people; there is nobody left to tell if that fails.
pub fn message(text: impl Display) {
    drop(writeln!(io::stderr().lock(), "{text}"));
}

/// Reports a failure that does not end the program.
pub fn failure(failure: &Failure) {
    // There is nobody left to tell if that fails.
    drop(failure.report(&mut io::stderr().lock()));
}

/// Whether standard error may be redrawn.
pub fn is_lively() -> bool {
    io::stderr().is_terminal()
}
