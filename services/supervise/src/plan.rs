//! What is to be run, and with how much patience.

use core::time::Duration;
use std::ffi::OsString;
use std::path::PathBuf;

use runtime::{Delivery, Namespace, Scheduling, TopicPlan};
use tracing::Level;

/// A deployment, as the supervisor sees it.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The program that becomes any of the services: `executable service <service> <args>`.
    pub executable: PathBuf,
    /// What every process finds in its standard input, in every life: a file that it needs could be removed meanwhile.
    pub given: Vec<u8>,
    /// Where the deployment lives.
    pub namespace: Namespace,
    /// The run; goes into the stamp of every message.
    pub session: u64,
    /// What happens when a receiver is slower than its sender.
    pub delivery: Delivery,
    /// All topics, those of the processes' signs of life included.
    pub topics: Vec<TopicPlan>,
    /// All processes, consumers first: a sender waits for its receivers anyway, but so it need not.
    pub processes: Vec<ProcessSpec>,
    /// How much patience there is.
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
    /// Its own arguments; what every service needs to know is added.
    pub args: Vec<OsString>,
    /// What becomes of the run without it.
    pub role: Role,
    /// What it asks of the system's scheduler.
    pub scheduling: Scheduling,
    /// How many times the processor time of any turn before it a turn of its main loop may take, some messages after
    /// the first; one that has taken more is no work any more. None if turns say nothing about each other.
    pub most_work: Option<u32>,
}

/// What becomes of the run when a process has been given up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The run fails.
    Essential,
    /// The run goes on, degraded, as long as one process of the same service is left.
    Redundant,
    /// The run goes on, degraded.
    Optional,
}

/// How much patience there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Policy {
    /// A process that has worked for so long is started again at once.
    pub steady_after: Duration,
    /// Pause before the restart of one that ended sooner; it doubles each time that it does so again.
    pub first_pause: Duration,
    /// Longest pause before a restart.
    pub longest_pause: Duration,
    /// Restarts within the window after which a process is given up.
    pub max_restarts: usize,
    /// How long a restart counts.
    pub restart_window: Duration,
    /// How long a process may take until its main loop turns for the first time.
    pub startup_limit: Duration,
    /// How long a process that the system calls stopped may give no sign of life; and the processor time that
    /// any turn of a main loop may take, however little those before it took ([`ProcessSpec::most_work`]).
    pub stopped_limit: Duration,
    /// How long any process may give no sign of life: they come from a thread of its own, whatever it
    /// computes, so one that is silent is stopped, or gets no processor.
    pub silence_limit: Duration,
    /// How long the main loop of a process may stand still: longer than any frame takes.
    pub hang_limit: Duration,
    /// How long those that wait for messages may wait in vain, once others are done and some had to
    /// be restarted or given up.
    pub idle_limit: Duration,
    /// How long processes may take to end when they are asked to.
    pub grace: Duration,
    /// How often what the dead left is cleaned up where no death was noticed.
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
    /// * `hasty`: how many of its last lives in a row ended before they were steady.
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
    fn who_worked_starts_at_once_and_pauses_of_others_double_up_to_the_longest_and_then_end() {
        let policy = Policy {
            max_restarts: 9,
            ..Policy::default()
        };
        let millis: Vec<_> = (0..10)
            .map(|nth| policy.pause(nth, nth as u32).map(|it| it.as_millis()))
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
