//! The plan of a run: processes, topics and time limits.

use core::time::Duration;
use std::ffi::OsString;
use std::path::PathBuf;

use runtime::{Delivery, Namespace, Scheduling, TopicPlan};
use tracing::Level;

/// A deployment, as the supervisor sees it.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Program that runs every service: `executable service <service> <args>`.
    pub executable: PathBuf,
    /// Bytes that every process reads from its standard input, also after a restart. (A file could have been removed before the restart.)
    pub given: Vec<u8>,
    /// Description of the deployment, which other programs of this user can read while it runs ([`Namespace::description`]).
    pub description: Vec<u8>,
    /// Namespace of the deployment.
    pub namespace: Namespace,
    /// Session, which is part of the stamp of every message.
    pub session: u64,
    /// Delivery: the behaviour if a receiver is slower than its sender.
    pub delivery: Delivery,
    /// All topics, including the topics of heartbeats.
    pub topics: Vec<TopicPlan>,
    /// All processes, consumers first, so that senders do not have to wait for their receivers.
    pub processes: Vec<ProcessSpec>,
    /// Time limits.
    pub policy: Policy,
    /// Log level of the services.
    pub log: Level,
}

/// One process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProcessSpec {
    /// Unique name of the process in the deployment, for example `pose-2`.
    pub name: String,
    /// Service that the process runs, for example `pose`.
    pub service: String,
    /// Arguments of this process only. The arguments that all services share are added to them.
    pub args: Vec<OsString>,
    /// Role, which determines whether the run continues without the process.
    pub role: Role,
    /// Names of the processes that send to this process. If all of them have been given up, this process is stopped. Otherwise its
    /// receivers would wait for a process that is alive but has nothing to send.
    pub senders: Vec<String>,
    /// Scheduling that the process requests from the system.
    pub scheduling: Scheduling,
    /// Limit on the processor time of an iteration of the main loop, as a multiple of the longest iteration so far. An iteration that takes
    /// longer counts as an endless loop. The limit applies once the process has sent a few messages. `None` if the iterations are not
    /// comparable.
    pub most_work: Option<u32>,
    /// True if the process completes its files after the stop request. It may take as long for this as a main loop may hang.
    pub completes_files: bool,
}

/// Consequence for the run when a process has been given up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The run fails.
    Essential,
    /// The run continues, degraded, as long as one process of the same service is left.
    Redundant,
    /// The run continues, degraded.
    Optional,
}

/// Time limits and restart limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Policy {
    /// A process that has worked for this long is restarted at once.
    pub steady_after: Duration,
    /// Pause before the restart of a process that died sooner. It doubles with every such death.
    pub first_pause: Duration,
    /// Longest pause before a restart.
    pub longest_pause: Duration,
    /// Number of restarts within the window after which a process is given up.
    pub max_restarts: usize,
    /// Length of the window in which restarts are counted.
    pub restart_window: Duration,
    /// Longest time until the first iteration of a process's main loop.
    pub startup_limit: Duration,
    /// Longest time without a heartbeat for a stopped process (SIGSTOP). Also the processor time that every iteration
    /// of a main loop may take, however short earlier iterations were ([`ProcessSpec::most_work`]).
    pub stopped_limit: Duration,
    /// Longest time without a heartbeat for any process. A separate thread sends heartbeats, so a silent process is
    /// stopped or gets no processor time.
    pub silence_limit: Duration,
    /// Longest time that the main loop of a process may hang. It is longer than any frame takes.
    pub hang_limit: Duration,
    /// Longest time that a process may wait without receiving a message. It applies only when other processes have finished, and at least
    /// one process was restarted or given up.
    pub idle_limit: Duration,
    /// Time that processes have to end after the stop request, except those that complete files.
    pub grace: Duration,
    /// Interval between clean-ups after dead processes. There is also a clean-up at every death.
    pub clean_period: Duration,
}

impl Default for Policy {
    fn default() -> Self {
        Self {
            steady_after: Duration::from_secs(1),
            first_pause: Duration::from_millis(100),
            longest_pause: Duration::from_secs(5),
            max_restarts: 5,
            restart_window: Duration::from_mins(1),
            startup_limit: Duration::from_mins(1),
            stopped_limit: 3 * runtime::HEARTBEAT,
            silence_limit: Duration::from_secs(10),
            hang_limit: Duration::from_mins(2),
            idle_limit: Duration::from_secs(10),
            grace: Duration::from_secs(5),
            clean_period: Duration::from_millis(250),
        }
    }
}

impl Policy {
    /// Returns the pause before the next restart, or `None` if the process is to be given up.
    ///
    /// * `recent`: number of restarts within the window.
    /// * `hasty`: number of consecutive deaths of the process before [`Policy::steady_after`].
    pub(crate) fn pause(&self, recent: usize, hasty: u32) -> Option<Duration> {
        if recent >= self.max_restarts {
            return None;
        }
        let Some(doublings) = hasty.checked_sub(1) else {
            return Some(Duration::ZERO);
        };
        let factor = 1_u32.checked_shl(doublings).unwrap_or(u32::MAX);
        let pause = self.first_pause.saturating_mul(factor);
        Some(pause.min(self.longest_pause))
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use super::Policy;

    #[test]
    fn steady_processes_restart_at_once_and_pauses_of_others_double_up_to_a_limit() {
        let policy = Policy {
            max_restarts: 9,
            ..Policy::default()
        };
        let millis: Vec<_> = (0..10)
            .map(|nth| policy.pause(nth, nth as u32).map(|pause| pause.as_millis()))
            .collect();
        let expected = [0, 100, 200, 400, 800, 1600, 3200, 5000, 5000].map(Some);
        assert_eq!(millis[..9], expected);
        assert_eq!(millis[9], None);
        assert_eq!(policy.pause(8, 0), Some(Duration::ZERO));
        assert_eq!(policy.pause(9, 0), None);
    }

    #[test]
    fn many_restarts_do_not_overflow() {
        let policy = Policy {
            max_restarts: usize::MAX,
            ..Policy::default()
        };
        for hasty in [32, 33, 34, u32::MAX] {
            let pause = policy.pause(usize::MAX - 1, hasty);
            assert_eq!(pause, Some(Duration::from_secs(5)));
        }
    }
}
