//! Options of all commands.

use crate::output::Verbosity;
use clap::{ArgAction, Args};
use tracing::Level;

/// Options of all commands.
#[derive(Debug, Clone, Copy, Args)]
pub struct Globals {
    /// Print errors only.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Log more: -v for information, -vv for debugging, -vvv for everything.
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
}

impl Globals {
    /// Returns the verbosity of output and log, for other crates.
    pub fn verbosity(self) -> Verbosity {
        Verbosity {
            quiet: self.quiet,
            level: self.level(),
        }
    }

    /// Returns the log level.
    pub fn level(self) -> Level {
        match (self.quiet, self.verbose) {
            (true, _) => Level::ERROR,
            (false, 0) => Level::WARN,
            (false, 1) => Level::INFO,
            (false, 2) => Level::DEBUG,
            (false, _) => Level::TRACE,
        }
    }
}
