//! Events that the supervisor reports during a run.

use core::fmt;
use core::time::Duration;

use messages::Health;

/// How a process ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Death {
    /// It ended on its own: with an exit status other than 0, or with 0 before it had finished.
    Exit {
        /// The exit status.
        status: i32,
    },
    /// A signal ended it.
    Signal {
        /// The signal.
        number: i32,
    },
    /// It was killed because its main loop hung.
    Hung {
        /// For how long.
        still: Duration,
    },
    /// It was killed because one iteration of its main loop took far more processor time than any before.
    Spun {
        /// Processor time of that iteration.
        worked: Duration,
        /// Processor time of the longest one before.
        longest: Duration,
    },
    /// It was killed because it sent no heartbeat.
    Silent {
        /// For how long.
        still: Duration,
    },
    /// It was killed because its main loop never started.
    NeverBegan {
        /// How long the supervisor waited.
        waited: Duration,
    },
    /// It could not be started.
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
                    "computed for {worked} ms in one iteration, where none took more than {longest} ms before"
                )
            }
            Self::Silent { still } => {
                write!(f, "sent no heartbeat for {:.1} s", still.as_secs_f64())
            }
            Self::NeverBegan { waited } => {
                write!(f, "did not start within {:.1} s", waited.as_secs_f64())
            }
            Self::NotStarted => f.write_str("could not be started"),
        }
    }
}

/// An event of a run; `process` is the name of a process.
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
    /// A process has sent a heartbeat.
    Health {
        /// Its name.
        process: &'a str,
        /// The heartbeat.
        health: &'a Health,
    },
    /// A process has finished.
    Finished {
        /// Its name.
        process: &'a str,
    },
    /// A process has died.
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
        /// The pause before.
        pause: Duration,
    },
    /// A process will not be started again.
    GivenUp {
        /// Its name.
        process: &'a str,
        /// How often it was restarted.
        restarts: u32,
    },
    /// A process is stopped: every process that sends to it is given up.
    Dismissed {
        /// Its name.
        process: &'a str,
    },
    /// The stop request is sent to all processes.
    Stopping,
}
