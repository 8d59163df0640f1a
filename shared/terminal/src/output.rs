//! Writes data to standard output and messages to standard error.

use core::fmt::{self, Display};
use std::io::{self, IsTerminal as _, Write as _};

use failure::{ExitKind, Failure, OrFail as _};
use indicatif::{HumanDuration, ProgressState, ProgressStyle};
use serde::Serialize;
use tracing::Level;

/// How much a command prints and logs.
#[derive(Debug, Clone, Copy)]
pub struct Verbosity {
    /// Print errors only.
    pub quiet: bool,
    /// The log level of this process and of the processes that it starts.
    pub level: Level,
}

/// Writes a line of data. A closed pipe (as with `| head`) is not an error.
///
/// # Errors
///
/// Fails if standard output cannot be written to.
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
/// Fails if standard output cannot be written to, or if the value cannot be represented in JSON.
pub fn json(value: &impl Serialize) -> Result<(), Failure> {
    line(serde_json::to_string(value).or_fail(ExitKind::Run)?)
}

/// Writes a message to the user. If standard error cannot be written to, nothing happens.
pub fn message(text: impl Display) {
    drop(writeln!(io::stderr().lock(), "{text}"));
}

/// Reports a failure after which the program continues.
pub fn failure(failure: &Failure) {
    // If writing to standard error fails, the failure cannot be reported.
    drop(failure.report(&mut io::stderr().lock()));
}

/// Returns the style of a progress bar; `None` if `indicatif` does not accept the template.
///
/// * `template`: template of `indicatif`. `{left}` is replaced by a comma and the remaining time, or by nothing while that time is unknown.
pub fn bar_style(template: &str) -> Option<ProgressStyle> {
    let style = ProgressStyle::with_template(template).ok()?;
    Some(
        style.with_key("left", |state: &ProgressState, out: &mut dyn fmt::Write| {
            let left = state.eta();
            let text = match left.as_secs() {
                0 if state.pos() == 0 || state.per_sec() <= 0.0 => return,
                0 => ", less than a second left".to_owned(),
                _ => format!(", {:#} left", HumanDuration(left)),
            };
            // An error of the bar's own buffer cannot be reported.
            out.write_str(&text).ok();
        }),
    )
}

/// Returns true if standard error is a terminal, so that a progress bar can be drawn.
pub fn is_terminal() -> bool {
    io::stderr().is_terminal()
}
