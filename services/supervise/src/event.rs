//! Events that the supervisor reports during a run.

use core::fmt;
use core::time::Duration;

use messages::Health;

/// Cause of the end of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Death {
    /// The process ended on its own: with an exit status other than 0, or with 0 before it had finished.
    Exit {
        /// The exit status.
        status: i32,
    },
    /// The process was ended by a signal.
    Signal {
        /// Number of the signal.
        number: i32,
    },
    /// The process was killed because its main loop hung.
    Hung {
        /// Duration of the hang.
        still: Duration,
    },
    /// The process was killed because one iteration of its main loop took far more processor time than any iteration before.
    Spun {
        /// Processor time of that iteration.
        worked: Duration,
        /// Processor time of the longest earlier iteration.
        longest: Duration,
    },
    /// The process was killed because it sent no heartbeat.
    Silent {
        /// Time since the last heartbeat.
        still: Duration,
    },
    /// The process was killed because its main loop never started.
    NeverBegan {
        /// Time that the supervisor waited.
        waited: Duration,
    },
    /// The process could not be started.
    NotStarted,
}

impl Death {
    /// Returns the time in which the process did nothing before it was killed.
    pub(crate) fn idle(&self) -> Duration {
        match *self {
            Self::Hung { still } | Self::Silent { still } => still,
            Self::NeverBegan { waited } => waited,
            Self::Exit { .. } | Self::Signal { .. } | Self::Spun { .. } | Self::NotStarted => {
                Duration::ZERO
            }
        }
    }
}

impl fmt::Display for Death {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exit { status: 0 } => f.write_str("ended with status 0 before it had finished"),
            Self::Exit { status } => write!(f, "ended with status {status}"),
            Self::Signal { number } => write!(f, "ended by signal {number}"),
            Self::Hung { still } => write!(f, "hung for {:.1} s", still.as_secs_f64()),
            Self::Spun { worked, longest } => {
                let [worked, longest] = [worked, longest].map(Duration::as_millis);
                write!(
                    f,
                    "computed for {worked} ms in one iteration, although no earlier iteration took more than {longest} ms"
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

/// An event of a run. `process` is the name of a process.
#[derive(Debug, Clone, PartialEq)]
pub enum Event<'a> {
    /// A process has been started.
    Started {
        /// Name of the process.
        process: &'a str,
        /// Process id.
        pid: u32,
        /// Number of restarts of the process.
        epoch: u32,
    },
    /// A process has written a line.
    Line {
        /// Name of the process.
        process: &'a str,
        /// The line.
        text: &'a str,
    },
    /// A process has sent a heartbeat.
    Health {
        /// Name of the process.
        process: &'a str,
        /// The heartbeat.
        health: &'a Health,
    },
    /// A process has finished.
    Finished {
        /// Name of the process.
        process: &'a str,
    },
    /// A process has died.
    Died {
        /// Name of the process.
        process: &'a str,
        /// Cause of the death.
        death: Death,
    },
    /// A process will be started again.
    Restarting {
        /// Name of the process.
        process: &'a str,
        /// Pause before the restart.
        pause: Duration,
    },
    /// A process will not be started again.
    GivenUp {
        /// Name of the process.
        process: &'a str,
        /// Number of restarts of the process.
        restarts: u32,
    },
    /// A process is stopped because every process that sends to it has been given up.
    Dismissed {
        /// Name of the process.
        process: &'a str,
    },
    /// The stop request is sent to all processes.
    Stopping,
    /// A process still writes its files some time after the stop request. The run waits for it.
    Awaited {
        /// Name of the process.
        process: &'a str,
    },
    /// A process did not end after the stop request, and was killed.
    Killed {
        /// Name of the process.
        process: &'a str,
        /// Time since the stop request.
        waited: Duration,
    },
}
