//! How a command ends: the exit codes that users and scripts may rely on.

use std::error::Error;
use std::process::ExitCode;

use crate::deployment::ConfigError;

/// The table of exit codes, as `--help` shows it.
pub(crate) const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  the run failed
    2  the command line is wrong
    3  the deployment file is wrong
    4  an input is missing or unreadable (footage, model, calibration file, table)
    5  the calibration cannot be used
    6  a limit was missed
    7  done, but degraded: views or processes were lost on the way
  130  stopped by Ctrl-C

Data goes to standard output, messages and progress to standard error.
Colours are off where NO_COLOR is set or standard error is no terminal.";

/// What went wrong, by exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The run failed.
    Run,
    /// The command line asks for something that cannot be.
    Usage,
    /// The deployment file is wrong.
    Config,
    /// An input is missing or unreadable.
    Input,
    /// The calibration cannot be used.
    Calibration,
    /// A limit was missed.
    Limit,
    /// Finished, but views or processes were lost.
    Degraded,
    /// Stopped by Ctrl-C.
    Interrupted,
}

impl Kind {
    /// The exit code.
    pub(crate) fn code(self) -> u8 {
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
}

/// Why a command failed: an error with its causes, and what to tell the shell.
#[derive(Debug)]
pub(crate) struct Failure {
    /// Decides the exit code.
    pub kind: Kind,
    /// The error.
    pub error: Box<dyn Error + Send + Sync>,
}

impl Failure {
    /// A failure of a kind.
    pub(crate) fn new(kind: Kind, error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        let error = error.into();
        Self { kind, error }
    }

    /// Writes the error and its causes to standard error, and gives the exit code.
    pub(crate) fn report(&self) -> ExitCode {
        crate::output::error(self.error.as_ref());
        ExitCode::from(self.kind.code())
    }
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        let kind = match error {
            ConfigError::Read { .. } => Kind::Input,
            _ => Kind::Config,
        };
        Self::new(kind, error)
    }
}

/// Gives an error its exit code: `read(path).failing(Kind::Input)?`.
pub(crate) trait Failing<T> {
    /// The error as a failure of this kind.
    fn failing(self, kind: Kind) -> Result<T, Failure>;
}

impl<T, E: Into<Box<dyn Error + Send + Sync>>> Failing<T> for Result<T, E> {
    fn failing(self, kind: Kind) -> Result<T, Failure> {
        self.map_err(|error| Failure::new(kind, error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_is_in_the_table_that_users_read() {
        for kind in [
            Kind::Run,
            Kind::Usage,
            Kind::Config,
            Kind::Input,
            Kind::Calibration,
            Kind::Limit,
            Kind::Degraded,
            Kind::Interrupted,
        ] {
            let line = format!("{:>5}  ", kind.code());
            assert!(EXIT_CODES.contains(&line), "{kind:?}");
        }
    }
}
