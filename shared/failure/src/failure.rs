//! Failures that end a process: the error, its cause, a hint for the user, and the exit status.

use core::error::Error;
use core::fmt;
use std::io::{self, Write};
use std::process::ExitCode;

use crate::wording::in_words;

/// Exit statuses, the same for the command and for all its services.
///
/// | status | meaning |
/// |---|---|
/// | 0 | done |
/// | 1 | the run failed: a process, the transport or the system failed |
/// | 2 | the command line is wrong |
/// | 3 | a configuration is wrong: an unknown key, a value out of range, settings that contradict each other |
/// | 4 | an input is missing, unreadable or malformed: footage, model, table |
/// | 5 | a calibration cannot be used: not a rotation, another image size, a camera without calibration |
/// | 6 | a requested limit was missed |
/// | 7 | the run ended, but degraded: views, frames or processes were lost during the run |
/// | 130 | interrupted |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitKind {
    /// The run failed.
    Run,
    /// The command line is wrong.
    Usage,
    /// A configuration is wrong.
    Config,
    /// An input is missing, unreadable or malformed.
    Input,
    /// A calibration cannot be used.
    Calibration,
    /// A requested limit was missed.
    Limit,
    /// The run ended, but degraded.
    Degraded,
    /// The run was interrupted.
    Interrupted,
}

impl ExitKind {
    /// All kinds.
    pub const ALL: [Self; 8] = [
        Self::Run,
        Self::Usage,
        Self::Config,
        Self::Input,
        Self::Calibration,
        Self::Limit,
        Self::Degraded,
        Self::Interrupted,
    ];

    /// Returns the exit status of the process.
    pub fn status(self) -> u8 {
        match self {
            Self::Run => 1,
            Self::Usage => 2,
            Self::Config => 3,
            Self::Input => 4,
            Self::Calibration => 5,
            Self::Limit => 6,
            Self::Degraded => 7,
            Self::Interrupted => 130,
        }
    }

    /// Returns the kind with an exit status, if there is one.
    pub fn of_status(status: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| i32::from(kind.status()) == status)
    }

    /// Returns true if the process would fail again in the same way, because its input is wrong.
    pub fn is_permanent(self) -> bool {
        matches!(
            self,
            Self::Usage | Self::Config | Self::Input | Self::Calibration
        )
    }
}

/// Failure that ends a process, with its exit status and a hint.
#[derive(Debug)]
pub struct Failure {
    kind: ExitKind,
    hint: Option<String>,
    source: Box<dyn Error + Send + Sync>,
}

impl Failure {
    /// Creates a failure of a kind.
    ///
    /// * `source`: an error, or a text.
    pub fn new(kind: ExitKind, source: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self {
            kind,
            hint: None,
            source: source.into(),
        }
    }

    /// Adds a hint for the user.
    #[must_use]
    pub fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds another hint for the user.
    #[must_use]
    pub fn with_another_hint(self, hint: impl Into<String>) -> Self {
        let hint = hint.into();
        let both = match &self.hint {
            Some(first) => format!("{first}\n  hint: {hint}"),
            None => hint,
        };
        self.with_hint(both)
    }

    /// Returns the kind of the failure.
    pub fn kind(&self) -> ExitKind {
        self.kind
    }

    /// Returns the error that happened.
    pub fn source(&self) -> &(dyn Error + 'static) {
        self.source.as_ref()
    }

    /// Writes `error:`, one line `cause:` for each cause, and `hint:` if there is a hint.
    ///
    /// # Errors
    ///
    /// Fails if `out` cannot be written to.
    pub fn report(&self, out: &mut dyn Write) -> io::Result<()> {
        for (depth, error) in crate::wording::chain(self.source()).enumerate() {
            let label = if depth == 0 { "error" } else { "  cause" };
            writeln!(out, "{label}: {}", in_words(&error.to_string()).trim_end())?;
        }
        if let Some(hint) = &self.hint {
            writeln!(out, "  hint: {hint}")?;
        }
        out.flush()
    }

    /// Writes the report to standard error and returns the exit status.
    pub fn exit(&self) -> ExitCode {
        if self.report(&mut io::stderr().lock()).is_err() {
            // The failure cannot be reported.
        }
        ExitCode::from(self.kind.status())
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.source.fmt(f)
    }
}

/// An error with an exit status, so that `?` turns it into a [`Failure`].
pub trait Fault: Error + Send + Sync + 'static {
    /// Returns the kind of failure.
    fn kind(&self) -> ExitKind {
        ExitKind::Run
    }

    /// Returns a remedy that the user may try, if one is known.
    fn hint(&self) -> Option<String> {
        None
    }
}

impl<E: Fault> From<E> for Failure {
    fn from(error: E) -> Self {
        let (kind, hint) = (error.kind(), error.hint());
        Self {
            kind,
            hint,
            source: Box::new(error),
        }
    }
}

/// Conversion of an error into a [`Failure`] with an exit status.
pub trait OrFail<T> {
    /// Turns the error into a [`Failure`] of a kind.
    ///
    /// # Errors
    ///
    /// Returns the error as a [`Failure`], if there is one.
    fn or_fail(self, kind: ExitKind) -> Result<T, Failure>;
}

impl<T, E: Into<Box<dyn Error + Send + Sync>>> OrFail<T> for Result<T, E> {
    fn or_fail(self, kind: ExitKind) -> Result<T, Failure> {
        self.map_err(|error| Failure::new(kind, error))
    }
}

/// Returns the exit status of a command, which is success if the command found something.
///
/// * `message`: the error message if the command found nothing.
///
/// # Errors
///
/// Returns `ExitKind::Degraded` with the message if nothing was found.
pub fn require_results(is_found: bool, message: &str) -> Result<ExitCode, Failure> {
    let failure = || Failure::new(ExitKind::Degraded, message);
    is_found.then_some(ExitCode::SUCCESS).ok_or_else(failure)
}

#[cfg(test)]
mod tests {
    use super::{ExitKind, Failure};

    #[derive(Debug, thiserror::Error)]
    #[error("cannot read model.bin")]
    struct Outer(#[source] std::io::Error);

    #[test]
    fn a_report_shows_error_cause_and_hints() {
        let failure = Failure::new(
            ExitKind::Input,
            Outer(std::io::Error::other("no such disk")),
        )
        .with_hint("look elsewhere")
        .with_another_hint("or ask");
        let mut text = Vec::new();
        failure.report(&mut text).unwrap();
        assert_eq!(
            String::from_utf8(text).unwrap(),
            "error: cannot read model.bin\n  cause: no such disk\n  hint: look elsewhere\n  hint: or ask\n"
        );
    }

    #[test]
    fn every_kind_of_failure_has_its_own_exit_code() {
        for kind in ExitKind::ALL {
            assert_eq!(ExitKind::of_status(i32::from(kind.status())), Some(kind));
        }
        for status in [0, 8, 101, 134] {
            assert_eq!(ExitKind::of_status(status), None);
        }
    }

    #[test]
    fn input_errors_are_permanent() {
        let permanent = ExitKind::ALL.map(|kind| (kind.status(), kind.is_permanent()));
        let statuses = permanent
            .iter()
            .filter(|(_, is_permanent)| *is_permanent)
            .map(|(status, _)| *status);
        assert_eq!(statuses.collect::<Vec<_>>(), [2, 3, 4, 5]);
    }
}
