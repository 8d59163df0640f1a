//! What the supervisor tells while it works.

use core::fmt;
use core::time::Duration;

use messages::Health;

/// How a process ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Death {
    /// It ended by itself: with an exit status other than 0, or with 0 before it was done.
    Exit {
        /// The exit status.
        status: i32,
    },
    /// A signal ended it.
    Signal {
        /// The signal.
        number: i32,
    },
    /// It was killed because its main loop stood still.
    Hung {
        /// For how long.
        still: Duration,
    },
    /// It was killed because one turn of its main loop took far more work than any before it.
    Spun {
        /// Processor time of that turn.
        worked: Duration,
        /// That of the longest before it.
        longest: Duration,
    },
    /// It was killed because it gave no sign of life.
    Silent {
        /// For how long.
        still: Duration,
    },
    /// It was killed because its main loop never began.
    NeverBegan {
        /// How long it was given.
        waited: Duration,
    },
    /// It could not even be started.
    NotStarted,
}

impl fmt::Display for Death {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exit { status: 0 } => f.write_str("ended with status 0 without having finished"),
            Self::Exit { status } => write!(f, "ended with status {status}"),
            Self::Signal { number } => write!(f, "ended by signal {number}"),
            Self::Hung { still } => write!(f, "hung for {:.1} s", still.as_secs_f64()),
            Self::Spun { worked, longest } => {
                let [worked, longest] = [worked, longest].map(Duration::as_millis);
                write!(
                    f,
                    "worked for {worked} ms on one thing, where none took more than {longest} ms before"
                )
            }
            Self::Silent { still } => {
                write!(f, "gave no sign of life for {:.1} s", still.as_secs_f64())
            }
            Self::NeverBegan { waited } => {
                write!(f, "did not begin within {:.1} s", waited.as_secs_f64())
            }
            Self::NotStarted => f.write_str("could not be started"),
        }
    }
}

/// What the supervisor tells while it works; `process` is the name of a process.
#[derive(Debug, Clone, PartialEq)]
pub enum Event<'a> {
    /// A process has been started.
    Started {
        /// Its name.
        process: &'a str,
        /// Its process id.
        pid: u32,
        /// How often it has been restarted.
        epoch: u32,
    },
    /// A process has written a line.
    Line {
        /// Its name.
        process: &'a str,
        /// The line.
        text: &'a str,
    },
    /// A process has given a sign of life.
    Health {
        /// Its name.
        process: &'a str,
        /// What it says.
        health: &'a Health,
    },
    /// A process is done.
    Finished {
        /// Its name.
        process: &'a str,
    },
    /// A process has ended that should not have.
    Died {
        /// Its name.
        process: &'a str,
        /// How.
        death: Death,
    },
    /// A process will be started again.
    Restarting {
        /// Its name.
        process: &'a str,
        /// When.
        pause: Duration,
    },
    /// A process will not be started again.
    GivenUp {
        /// Its name.
        process: &'a str,
        /// How often it had been.
        restarts: u32,
    },
    /// All processes are being asked to end.
    Stopping,
}
