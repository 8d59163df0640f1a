//! The plan of a run: processes, topics and time limits.

use core::time::Duration;
use std::ffi::OsString;
use std::path::PathBuf;

use runtime::{Delivery, Namespace, Scheduling, TopicPlan};
use tracing::Level;

/// A deployment, as the supervisor sees it.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The program that runs every service: `executable service <service> <args>`.
    pub executable: PathBuf,
    /// The standard input of every process, also after a restart: a file could be removed in the meantime.
    pub given: Vec<u8>,
    /// Description of the deployment that others of this user can read while it runs ([`Namespace::description`]).
    pub description: Vec<u8>,
    /// The location of the deployment.
    pub namespace: Namespace,
    /// The session, which goes into the stamp of every message.
    pub session: u64,
    /// Delivery: decides what happens when a receiver is slower than its sender.
    pub delivery: Delivery,
    /// All topics, including those of the heartbeats.
    pub topics: Vec<TopicPlan>,
    /// All processes, consumers first, so that senders do not have to wait for their receivers.
    pub processes: Vec<ProcessSpec>,
    /// Time limits.
    pub policy: Policy,
    /// The least important events that services log.
    pub log: Level,
}

/// One process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProcessSpec {
    /// Its unique name in the deployment, for example `pose-2`.
    pub name: String,
    /// Which service it is, for example `pose`.
    pub service: String,
    /// Its own arguments; those of every service are added.
    pub args: Vec<OsString>,
    /// Role: decides what happens to the run without the process.
    pub role: Role,
    /// Names of the processes that send to it. Once all of them are given up, it is stopped: its receivers would wait
    /// for a process that is alive and has nothing to send.
    pub senders: Vec<String>,
    /// Its requests to the system's scheduler.
    pub scheduling: Scheduling,
    /// After some messages: how many times the processor time of the longest iteration of its main loop an
    /// iteration may take. One that takes more is taken for an endless loop. None if the iterations are not
    /// comparable.
    pub most_work: Option<u32>,
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

/// How much patience there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Policy {
    /// A process that has worked for this long is restarted at once.
    pub steady_after: Duration,
    /// Pause before the restart of one that died sooner; doubles with every such death.
    pub first_pause: Duration,
    /// Longest pause before a restart.
    pub longest_pause: Duration,
    /// Restarts within the window after which a process is given up.
    pub max_restarts: usize,
    /// How long a restart counts.
    pub restart_window: Duration,
    /// How long a process may take until the first iteration of its main loop.
    pub startup_limit: Duration,
    /// How long a stopped process (SIGSTOP) may send no heartbeat; and the processor time that any iteration
    /// of a main loop may take, however short those before were ([`ProcessSpec::most_work`]).
    pub stopped_limit: Duration,
    /// How long any process may send no heartbeat. A separate thread sends them, so a silent process is
    /// stopped or gets no processor time.
    pub silence_limit: Duration,
    /// How long the main loop of a process may hang: longer than any frame takes.
    pub hang_limit: Duration,
    /// How long a process may wait for messages without receiving any, once others have finished and some
    /// were restarted or given up.
    pub idle_limit: Duration,
    /// How long processes may take to end after the stop request.
    pub grace: Duration,
    /// Period of the clean-up after dead processes, besides that at every death.
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
    /// The pause before the next restart, or none if the process is to be given up.
    ///
    /// * `recent`: restarts within the window.
    /// * `hasty`: how many times in a row it died before [`Policy::steady_after`].
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
