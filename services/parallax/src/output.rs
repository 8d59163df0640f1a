//! Data to standard output, messages to standard error.

use std::error::Error;
use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write as _};

use serde::Serialize;

use crate::cli::Globals;
use crate::failure::{Failure, Kind};

/// Writes a line of data. A reader that went away (`| head`) is no failure.
pub(crate) fn line(text: impl Display) -> Result<(), Failure> {
    match writeln!(io::stdout().lock(), "{text}") {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::new(Kind::Run, error))
        }
        _ => Ok(()),
    }
}

/// Writes a value as one line of JSON.
pub(crate) fn json(value: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string(value).map_err(|error| Failure::new(Kind::Run, error))?;
    line(text)
}

/// Writes a message for people; there is nobody left to tell if that fails.
pub(crate) fn message(text: impl Display) {
    drop(writeln!(io::stderr().lock(), "{text}"));
}

/// Writes an error and its causes.
pub(crate) fn error(error: &(dyn Error + 'static)) {
    message(format_args!("{}: {error}", painted("error", "31;1")));
    let mut cause = error.source();
    while let Some(error) = cause {
        message(format_args!("  because: {error}"));
        cause = error.source();
    }
}

/// Whether standard error may be coloured and redrawn.
pub(crate) fn is_lively() -> bool {
    io::stderr().is_terminal()
}

fn painted(text: &str, style: &str) -> String {
    if is_lively() && std::env::var_os("NO_COLOR").is_none_or(|it| it.is_empty()) {
        format!("\u{1b}[{style}m{text}\u{1b}[0m")
    } else {
        text.to_owned()
    }
}

/// Begins logging to standard error, as loud as `-q` and `-v` say.
pub(crate) fn start_log(_globals: &Globals) {}
