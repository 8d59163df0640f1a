//! A supervised process: its state, its heartbeats, and its restarts.

use core::time::Duration;
use std::collections::VecDeque;
use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;
use std::time::Instant;

use failure::ExitKind;
use messages::{Health, Metrics, Refusal};
use runtime::{Child, Subscriber};

use crate::{Counts, Death, Policy, ProcessOutcome, ProcessSpec, State};

/// A main loop that has completed an iteration within this time counts as waiting for messages, not as computing.
const WAITING: Duration = Duration::from_secs(1);
/// Number of messages that a process has to send before iterations are compared, because the first iterations take more work.
const WARM_UP_MESSAGES: u64 = 8;
/// Number of output lines that are kept to explain a death.
const KEPT_LINES: usize = 40;

/// A supervised process.
#[derive(Debug)]
pub(crate) struct Watch {
    pub(crate) spec: ProcessSpec,
    pub(crate) heartbeats: Subscriber<Health>,
    pub(crate) metrics: Subscriber<Metrics>,
    pub(crate) phase: Phase,
    pub(crate) epoch: u32,
    restarts: Restarts,
    /// Time of the first iteration of the main loop since the last start.
    at_work_since: Option<Instant>,
    /// True if the main loop ran before an earlier restart, which shows that the input was usable.
    has_worked: bool,
    /// Number of consecutive deaths of the process before [`Policy::steady_after`].
    n_hasty: u32,
    output: VecDeque<String>,
    /// Counts before the last restart.
    past: Counts,
    /// The last heartbeat since the last start.
    current: Option<Health>,
    /// The last heartbeat, possibly from before a restart.
    last: Option<Health>,
    /// The last metrics, possibly from before a restart.
    measured: Option<Metrics>,
    /// Time of the last heartbeat, by the heartbeat's own time stamp.
    heartbeat: Change,
    /// Time of the last iteration of the main loop.
    iteration: Change,
    /// Time of the last received message.
    received: Change,
    work: Work,
    /// True if the process was stopped because no process is left that sends to it.
    pub(crate) is_dismissed: bool,
}

/// The state of a process.
#[derive(Debug)]
pub(crate) enum Phase {
    /// The process is running.
    Running(Child),
    /// The process will be started at this time.
    Due(Instant),
    /// The process ended regularly.
    Ended(State),
    /// The process will not be restarted.
    GivenUp,
}

/// A counter, and the time of its last change.
#[derive(Debug, Clone, Copy)]
struct Change {
    count: u64,
    at: Instant,
}

impl Change {
    fn new(now: Instant) -> Self {
        Self { count: 0, at: now }
    }

    fn note(&mut self, count: u64, now: Instant) {
        if count != self.count {
            *self = Self { count, at: now };
        }
    }
}

/// Processor time of the iterations of a main loop. Unlike wall-clock time, it does not depend on other
/// load. Waiting takes little processor time (a spinning process iterates all the time).
#[derive(Debug, Clone, Copy, Default)]
struct Work {
    /// Processor time of the process at the first heartbeat after its last iteration, in milliseconds modulo
    /// 2^32.
    at_iteration: u32,
    /// Processor time since the last iteration.
    since_iteration: Duration,
    /// Processor time of the longest iteration since the last start. All iterations between two heartbeats count as one.
    longest: Duration,
}

impl Work {
    /// Processes the processor time in a heartbeat.
    ///
    /// * `iterated`: true if there was an iteration since the last heartbeat.
    /// * `is_first`: true if this is the first heartbeat.
    fn note(&mut self, cpu_millis: u32, iterated: bool, is_first: bool) {
        let used = u64::from(cpu_millis.wrapping_sub(self.at_iteration));
        self.since_iteration = Duration::from_millis(used);
        if iterated {
            if !is_first {
                self.longest = self.longest.max(self.since_iteration);
            }
            self.at_iteration = cpu_millis;
            self.since_iteration = Duration::ZERO;
        }
    }
}

/// Times of recent restarts. The time in which the process did nothing before it was killed is not counted: a process that hangs for
/// longer than the window after every restart would never be given up.
#[derive(Debug, Default)]
struct Restarts(VecDeque<Instant>);

impl Restarts {
    /// Returns the number of restarts within the window.
    ///
    /// * `idle`: time in which the process did nothing before it died.
    fn n_recent(&mut self, idle: Duration, window: Duration, now: Instant) -> usize {
        self.0.iter_mut().for_each(|restart| *restart += idle);
        self.0.retain(|restart| now.saturating_duration_since(*restart) <= window);
        self.0.len()
    }
}

/// Consequence of a death.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sequel {
    /// The process is restarted after a pause.
    Restart(Duration),
    /// The process is not restarted, because it failed too often.
    GiveUp,
    /// The run fails, because the input is wrong.
    Fail(ExitKind),
}

impl Watch {
    /// Returns a process that is to be started at once.
    pub(crate) fn new(
        spec: ProcessSpec,
        heartbeats: Subscriber<Health>,
        metrics: Subscriber<Metrics>,
        now: Instant,
    ) -> Self {
        Self {
            spec,
            heartbeats,
            metrics,
            phase: Phase::Due(now),
            epoch: 0,
            restarts: Restarts::default(),
            at_work_since: None,
            has_worked: false,
            n_hasty: 0,
            output: VecDeque::new(),
            past: Counts::default(),
            current: None,
            last: None,
            measured: None,
            heartbeat: Change::new(now),
            iteration: Change::new(now),
            received: Change::new(now),
            work: Work::default(),
            is_dismissed: false,
        }
    }

    /// Records that the process was started.
    pub(crate) fn begin(&mut self, child: Child, now: Instant) {
        self.phase = Phase::Running(child);
        self.output.clear();
        self.at_work_since = None;
        self.heartbeat = Change::new(now);
        self.iteration = Change::new(now);
        self.received = Change::new(now);
        self.work = Work::default();
        self.is_dismissed = false;
    }

    pub(crate) fn child(&self) -> Option<&Child> {
        match &self.phase {
            Phase::Running(child) => Some(child),
            Phase::Due(_) | Phase::Ended(_) | Phase::GivenUp => None,
        }
    }

    /// Keeps a line of output.
    pub(crate) fn note_line(&mut self, line: &str) {
        if self.output.len() == KEPT_LINES {
            self.output.pop_front();
        }
        self.output.push_back(line.to_owned());
    }

    /// Processes a heartbeat. Heartbeats from before a restart are ignored, and those of other processes and runs are
    /// counted.
    pub(crate) fn note_health(&mut self, health: &Health, session: u64, now: Instant) -> bool {
        if health.session != session {
            return self.refuse(Refusal::Session);
        }
        if health.epoch != self.epoch {
            return false;
        }
        let Some(pid) = self.child().map(Child::pid) else {
            return false;
        };
        if pid != health.pid {
            return self.refuse(Refusal::Sender);
        }
        self.heartbeat.note(health.at_nanos, now);
        let (iterated, is_first) = (
            health.n_loops != self.iteration.count,
            self.iteration.count == 0,
        );
        self.work.note(health.cpu_millis, iterated, is_first);
        self.iteration.note(health.n_loops, now);
        if self.iteration.count > 0 && self.at_work_since.is_none() {
            self.at_work_since = Some(now);
            // The process could not receive messages before.
            self.received.at = now;
        }
        self.received.note(health.n_received, now);
        self.current = Some(*health);
        self.last = self.current;
        true
    }

    /// Stores metrics. They are kept even if the process is killed.
    pub(crate) fn note_metrics(&mut self, metrics: &Metrics) {
        self.measured = Some(*metrics);
    }

    fn refuse(&mut self, cause: Refusal) -> bool {
        self.past.refused[cause as usize] += 1;
        false
    }

    /// Restarts all timers, because the supervisor itself was stopped.
    pub(crate) fn restart_timers(&mut self, now: Instant) {
        self.heartbeat.at = now;
        self.iteration.at = now;
        self.received.at = now;
    }

    /// Returns the reason to kill the process, if there is one.
    pub(crate) fn overdue(&self, policy: &Policy, now: Instant) -> Option<Death> {
        let child = self.child()?;
        let since = |change: Change| now.saturating_duration_since(change.at);
        let (silent, still) = (since(self.heartbeat), since(self.iteration));
        if self.iteration.count == 0 {
            (still > policy.startup_limit).then_some(Death::NeverBegan { waited: still })
        } else if silent > policy.silence_limit
            || (silent > policy.stopped_limit && child.is_stopped())
        {
            Some(Death::Silent { still: silent })
        } else if self.is_in_endless_loop(policy, now) {
            Some(Death::Spun {
                worked: self.work.since_iteration,
                longest: self.work.longest,
            })
        } else if still <= policy.hang_limit {
            None
        } else if silent > still / 2 {
            // A stopped process neither iterates nor sends heartbeats. The missing heartbeats are reported as the cause.
            Some(Death::Silent { still: silent })
        } else {
            Some(Death::Hung { still })
        }
    }

    /// Returns true if the current iteration takes far longer than any before.
    fn is_in_endless_loop(&self, policy: &Policy, now: Instant) -> bool {
        let worked = |since| now.saturating_duration_since(since) >= policy.steady_after;
        let is_too_much = |factor| {
            let most = policy.stopped_limit.max(factor * self.work.longest);
            self.work.since_iteration >= most
        };
        self.spec.most_work.is_some_and(is_too_much)
            && self.current.is_some_and(|health| health.n_sent >= WARM_UP_MESSAGES)
            && self.at_work_since.is_some_and(worked)
    }

    /// Records a death, and decides what follows.
    pub(crate) fn die(&mut self, death: Death, policy: &Policy, now: Instant) -> Sequel {
        self.past = self.past.and(self.current.take().as_ref());
        // An input that was usable before may be usable again, and other processes still use it.
        if !self.has_worked
            && let Death::Exit { status } = death
            && let Some(kind) = ExitKind::of_status(status).filter(|kind| kind.is_permanent())
        {
            self.phase = Phase::GivenUp;
            return Sequel::Fail(kind);
        }
        let n_recent = self.restarts.n_recent(death.idle(), policy.restart_window, now);
        self.has_worked |= self.at_work_since.is_some();
        let worked = |since| now.saturating_duration_since(since) >= policy.steady_after;
        let is_steady = self.at_work_since.is_some_and(worked);
        self.n_hasty = if is_steady { 0 } else { self.n_hasty + 1 };
        let Some(pause) = policy.pause(n_recent, self.n_hasty) else {
            self.phase = Phase::GivenUp;
            return Sequel::GiveUp;
        };
        self.restarts.0.push_back(now);
        self.epoch += 1;
        self.phase = Phase::Due(now + pause);
        Sequel::Restart(pause)
    }

    /// Records a regular end of the process: it had finished, or was stopped.
    pub(crate) fn end(&mut self) {
        self.phase = Phase::Ended(if self.reports_finished() {
            State::Finished
        } else {
            State::Stopped
        });
    }

    /// Returns true if the process has received the end of the stream and sent it on.
    pub(crate) fn is_finished(&self) -> bool {
        match self.phase {
            Phase::Ended(_) => true,
            Phase::Running(_) => self.reports_finished(),
            Phase::Due(_) | Phase::GivenUp => false,
        }
    }

    /// Returns true if the process waits for messages, but has received no message for so long that no more messages are expected. A process
    /// with incomplete frames is not idle: it processes them once it stops waiting for the missing views, which may take longer.
    pub(crate) fn is_idle(&self, policy: &Policy, now: Instant) -> bool {
        let since = |change: Change| now.saturating_duration_since(change.at);
        self.child().is_some()
            && since(self.iteration) < WAITING
            && since(self.received) > policy.idle_limit
            && self.current.is_none_or(|health| health.n_waiting == 0)
    }

    /// Returns the time that the process has to end after the stop request. A process that completes files has more time, as long as it sends
    /// heartbeats.
    pub(crate) fn grace(&self, policy: &Policy, now: Instant) -> Duration {
        let silent = now.saturating_duration_since(self.heartbeat.at);
        if self.spec.completes_files && silent <= policy.silence_limit {
            policy.grace.max(policy.hang_limit)
        } else {
            policy.grace
        }
    }

    /// Returns true if the heartbeats of the process report that it has finished.
    pub(crate) fn reports_finished(&self) -> bool {
        self.current.is_some_and(|health| health.finished != 0)
    }

    pub(crate) fn is_given_up(&self) -> bool {
        matches!(self.phase, Phase::GivenUp)
    }

    /// Returns true if the process will not send anything more, but has not sent the end of its stream.
    pub(crate) fn is_lost(&self) -> bool {
        match self.phase {
            Phase::GivenUp => true,
            Phase::Ended(_) => self.is_dismissed,
            Phase::Running(_) | Phase::Due(_) => false,
        }
    }

    /// Returns the output that explains the end of the process: from the last `error:` on, or the last lines.
    pub(crate) fn message(&self) -> String {
        let begin = self
            .output
            .iter()
            .rposition(|line| line.starts_with("error:"))
            .unwrap_or(self.output.len().saturating_sub(3));
        let lines: Vec<&str> = self.output.iter().skip(begin).map(String::as_str).collect();
        lines.join("\n")
    }

    pub(crate) fn outcome(&self) -> ProcessOutcome {
        let state = match self.phase {
            Phase::GivenUp => State::GivenUp,
            Phase::Ended(state) => state,
            Phase::Due(_) => State::Stopped,
            Phase::Running(_) => State::Running,
        };
        ProcessOutcome {
            name: self.spec.name.clone(),
            service: self.spec.service.clone(),
            state,
            restarts: self.epoch,
            counts: self.past.and(self.current.as_ref()),
            last: self.last,
            measured: self.measured,
        }
    }
}

/// Returns the cause of a death from the exit status; `None` if the process ended regularly.
///
/// * `is_in_order`: true if the process had finished or was stopped.
pub(crate) fn death_of(status: ExitStatus, is_in_order: bool) -> Option<Death> {
    match (status.code(), status.signal()) {
        (Some(0), _) if is_in_order => None,
        (Some(status), _) => Some(Death::Exit { status }),
        (None, Some(number)) => Some(Death::Signal { number }),
        (None, None) => Some(Death::Exit { status: -1 }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn status_0_without_having_finished_is_a_failure() {
        let well = ExitStatus::from_raw(0);
        assert_eq!(death_of(well, true), None);
        let death = death_of(well, false).unwrap();
        assert_eq!(death, Death::Exit { status: 0 });
        let expected = "ended with status 0 before it had finished";
        assert_eq!(death.to_string(), expected);
        let (killed, failed) = (ExitStatus::from_raw(15), ExitStatus::from_raw(1 << 8));
        for in_order in [true, false] {
            let deaths = [killed, failed].map(|status| death_of(status, in_order));
            let of_status = [Death::Signal { number: 15 }, Death::Exit { status: 1 }];
            assert_eq!(deaths, of_status.map(Some));
        }
    }

    #[test]
    fn the_work_of_an_iteration_is_the_processor_time_until_the_next_iteration() {
        let mut work = Work::default();
        let millis = Duration::from_millis;
        // The start-up does not count as an iteration.
        work.note(900, true, true);
        work.note(1000, false, false);
        assert_eq!(
            (work.since_iteration, work.longest),
            (millis(100), millis(0))
        );
        work.note(1080, true, false);
        assert_eq!(
            (work.since_iteration, work.longest),
            (millis(0), millis(180))
        );
        work.note(1100, true, false);
        assert_eq!(
            (work.since_iteration, work.longest),
            (millis(0), millis(180))
        );
    }

    #[test]
    fn the_time_of_a_hang_does_not_count_against_the_window_of_restarts() {
        let secs = Duration::from_secs;
        let mut now = Instant::now();
        let mut restarts = Restarts::default();
        for nth in 0..3 {
            assert_eq!(restarts.n_recent(secs(120), secs(60), now), nth);
            restarts.0.push_back(now);
            now += secs(121);
        }
        assert_eq!(restarts.n_recent(Duration::ZERO, secs(60), now), 0);
    }

    #[test]
    fn processor_time_may_wrap_around() {
        let mut work = Work::default();
        work.note(u32::MAX - 9, true, true);
        work.note(20, false, false);
        assert_eq!(work.since_iteration, Duration::from_millis(30));
    }
}
