//! Options of every command.

use clap::{ArgAction, Args};
use launch::output::Verbosity;
use tracing::Level;

/// Options of every command.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Globals {
    /// Say less: errors only.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more; twice says everything.
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
}

impl Globals {
    /// How much is said, for work that is done elsewhere.
    pub(crate) fn verbosity(self) -> Verbosity {
        Verbosity {
            quiet: self.quiet,
            level: self.level(),
        }
    }

    /// The least important events that are logged.
    pub(crate) fn level(self) -> Level {
        match (self.quiet, self.verbose) {
            (true, _) => Level::ERROR,
            (false, 0) => Level::WARN,
            (false, 1) => Level::INFO,
            (false, 2) => Level::DEBUG,
            (false, _) => Level::TRACE,
        }
    }
}
