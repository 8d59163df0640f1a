//! One process under watch: its life, its signs of life, and its restarts.

use core::time::Duration;
use std::collections::VecDeque;
use std::os::unix::process::ExitStatusExt as _;
use std::process::ExitStatus;
use std::time::Instant;

use messages::{Health, Metrics, Refusal};
use runtime::{Child, ExitKind, Subscriber};

use crate::{Counts, Death, Policy, ProcessOutcome, ProcessSpec, State};

/// A main loop that turned since then is one that waits, not one that computes.
const AWAKE: Duration = Duration::from_secs(1);
/// Messages that it has sent before: the first ones are more work than the others.
const TRIED: u64 = 8;
/// Lines of output that are kept to explain a death.
const KEPT_LINES: usize = 40;

/// A process under watch.
#[derive(Debug)]
pub(crate) struct Watch {
    pub(crate) spec: ProcessSpec,
    pub(crate) signs: Subscriber<Health>,
    pub(crate) metrics: Subscriber<Metrics>,
    pub(crate) life: Life,
    pub(crate) epoch: u32,
    /// When it was restarted, within the window.
    restarts: VecDeque<Instant>,
    /// When the main loop of this life turned for the first time.
    at_work_since: Option<Instant>,
    /// Whether the main loop of an earlier life turned: what it was given was good then.
    has_worked: bool,
    /// How many lives in a row ended before they were steady, the last ones.
    n_hasty: u32,
    output: VecDeque<String>,
    /// What earlier lives did.
    past: Counts,
    /// The last sign of this life.
    current: Option<Health>,
    /// The last sign of any life.
    last: Option<Health>,
    /// What any life has said last of its times and counts.
    measured: Option<Metrics>,
    /// When it last gave a sign of life, by its own clock.
    signed: Change,
    /// When the main loop last turned.
    turned: Change,
    /// When it last took something in.
    received: Change,
    work: Work,
}

/// Where a process is in its life.
#[derive(Debug)]
pub(crate) enum Life {
    /// It runs.
    Running(Child),
    /// It will be started.
    Due(Instant),
    /// It ended as it should.
    Ended(State),
    /// It will not be started again.
    GivenUp,
}

/// A counter, and when it last changed.
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

/// The processor time that turns of a main loop take: other than time by the clock it does not depend on what
/// else the machine does, and little of it passes while one waits (one that waits without sleeping turns all the time).
#[derive(Debug, Clone, Copy, Default)]
struct Work {
    /// All that the process had used at the first sign after its last turn, milliseconds modulo 2^32.
    at_turn: u32,
    /// What it has used since.
    since_turn: Duration,
    /// The most that any turn of this life has taken; those between two signs count as one.
    longest: Duration,
}

impl Work {
    /// * `turned`: whether the main loop has, since the sign before.
    /// * `is_first`: whether it had not before.
    fn note(&mut self, cpu_millis: u32, turned: bool, is_first: bool) {
        let used = u64::from(cpu_millis.wrapping_sub(self.at_turn));
        self.since_turn = Duration::from_millis(used);
        if turned {
            if !is_first {
                self.longest = self.longest.max(self.since_turn);
            }
            self.at_turn = cpu_millis;
            self.since_turn = Duration::ZERO;
        }
    }
}

/// What is to follow a death.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sequel {
    /// Another life, after a pause.
    Restart(Duration),
    /// Nothing: it failed too often.
    GiveUp,
    /// The end of the run: the fault is in what it was given.
    Fail(ExitKind),
}

impl Watch {
    /// A process that is to be started at once.
    pub(crate) fn new(
        spec: ProcessSpec,
        signs: Subscriber<Health>,
        metrics: Subscriber<Metrics>,
        now: Instant,
    ) -> Self {
        Self {
            spec,
            signs,
            metrics,
            life: Life::Due(now),
            epoch: 0,
            restarts: VecDeque::new(),
            at_work_since: None,
            has_worked: false,
            n_hasty: 0,
            output: VecDeque::new(),
            past: Counts::default(),
            current: None,
            last: None,
            measured: None,
            signed: Change::new(now),
            turned: Change::new(now),
            received: Change::new(now),
            work: Work::default(),
        }
    }

    /// Begins a life.
    pub(crate) fn begin(&mut self, child: Child, now: Instant) {
        self.life = Life::Running(child);
        self.output.clear();
        self.at_work_since = None;
        self.signed = Change::new(now);
        self.turned = Change::new(now);
        self.received = Change::new(now);
        self.work = Work::default();
    }

    pub(crate) fn child(&self) -> Option<&Child> {
        match &self.life {
            Life::Running(child) => Some(child),
            Life::Due(_) | Life::Ended(_) | Life::GivenUp => None,
        }
    }

    /// Keeps a line of output.
    pub(crate) fn note_line(&mut self, line: &str) {
        if self.output.len() == KEPT_LINES {
            self.output.pop_front();
        }
        self.output.push_back(line.to_owned());
    }

    /// Takes note of a sign of life. Those of earlier lives are ignored, those of other processes and
    /// runs counted.
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
        self.signed.note(health.at_nanos, now);
        let (turned, is_first) = (health.n_loops != self.turned.count, self.turned.count == 0);
        self.work.note(health.cpu_millis, turned, is_first);
        self.turned.note(health.n_loops, now);
        if self.turned.count > 0 && self.at_work_since.is_none() {
            self.at_work_since = Some(now);
            // It could not receive anything before.
            self.received.at = now;
        }
        self.received.note(health.n_received, now);
        self.current = Some(*health);
        self.last = self.current;
        true
    }

    /// Takes note of times and counts, which a killed process has sent too.
    pub(crate) fn note_metrics(&mut self, metrics: &Metrics) {
        self.measured = Some(*metrics);
    }

    fn refuse(&mut self, cause: Refusal) -> bool {
        self.past.refused[cause as usize] += 1;
        false
    }

    /// Counts the time from now on: the supervisor itself has been asleep.
    pub(crate) fn forgive(&mut self, now: Instant) {
        self.signed.at = now;
        self.turned.at = now;
        self.received.at = now;
    }

    /// Whether the process should be killed, and as what.
    pub(crate) fn overdue(&self, policy: &Policy, now: Instant) -> Option<Death> {
        let child = self.child()?;
        let since = |change: Change| now.saturating_duration_since(change.at);
        let (silent, still) = (since(self.signed), since(self.turned));
        if self.turned.count == 0 {
            (still > policy.startup_limit).then_some(Death::NeverBegan { waited: still })
        } else if silent > policy.silence_limit
            || (silent > policy.stopped_limit && child.is_stopped())
        {
            Some(Death::Silent { still: silent })
        } else if self.computes_for_ever(policy, now) {
            Some(Death::Spun {
                worked: self.work.since_turn,
                longest: self.work.longest,
            })
        } else if still <= policy.hang_limit {
            None
        } else if silent > still / 2 {
            // Who is stopped stands still as well, and is called what it is.
            Some(Death::Silent { still: silent })
        } else {
            Some(Death::Hung { still })
        }
    }

    /// Whether it has worked on one thing far longer than on anything before.
    fn computes_for_ever(&self, policy: &Policy, now: Instant) -> bool {
        let worked = |since| now.saturating_duration_since(since) >= policy.steady_after;
        let is_too_much = |factor| {
            let most = policy.stopped_limit.max(factor * self.work.longest);
            self.work.since_turn >= most
        };
        self.spec.most_work.is_some_and(is_too_much)
            && self.current.is_some_and(|it| it.n_sent >= TRIED)
            && self.at_work_since.is_some_and(worked)
    }

    /// Ends a life, and says what is to follow.
    pub(crate) fn die(&mut self, death: Death, policy: &Policy, now: Instant) -> Sequel {
        self.past = self.past.and(self.current.take().as_ref());
        // What an earlier life could use may be back for a later one; the others have it and go on.
        if !self.has_worked
            && let Death::Exit { status } = death
            && let Some(kind) = ExitKind::of_status(status).filter(|kind| kind.is_permanent())
        {
            self.life = Life::GivenUp;
            return Sequel::Fail(kind);
        }
        while let Some(&first) = self.restarts.front()
            && now.saturating_duration_since(first) > policy.restart_window
        {
            self.restarts.pop_front();
        }
        self.has_worked |= self.at_work_since.is_some();
        let worked = |since| now.saturating_duration_since(since) >= policy.steady_after;
        let is_steady = self.at_work_since.is_some_and(worked);
        self.n_hasty = if is_steady { 0 } else { self.n_hasty + 1 };
        let Some(pause) = policy.pause(self.restarts.len(), self.n_hasty) else {
            self.life = Life::GivenUp;
            return Sequel::GiveUp;
        };
        self.restarts.push_back(now);
        self.epoch += 1;
        self.life = Life::Due(now + pause);
        Sequel::Restart(pause)
    }

    /// Ends a life that ended well: it was done, or was asked to end.
    pub(crate) fn end(&mut self) {
        self.life = Life::Ended(if self.says_finished() {
            State::Finished
        } else {
            State::Stopped
        });
    }

    /// Whether it has seen the end of the footage and passed it on.
    pub(crate) fn is_finished(&self) -> bool {
        match self.life {
            Life::Ended(_) => true,
            Life::Running(_) => self.says_finished(),
            Life::Due(_) | Life::GivenUp => false,
        }
    }

    /// Whether it waits for messages, and has got none for so long that none will come.
    pub(crate) fn is_idle(&self, policy: &Policy, now: Instant) -> bool {
        let since = |change: Change| now.saturating_duration_since(change.at);
        self.child().is_some()
            && since(self.turned) < AWAKE
            && since(self.received) > policy.idle_limit
    }

    /// Whether this life has said that its work is done.
    pub(crate) fn says_finished(&self) -> bool {
        self.current.is_some_and(|health| health.finished != 0)
    }

    pub(crate) fn is_given_up(&self) -> bool {
        matches!(self.life, Life::GivenUp)
    }

    /// What it wrote about its end: from the last `error:` on, or the last lines.
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
        let state = match self.life {
            Life::GivenUp => State::GivenUp,
            Life::Ended(state) => state,
            Life::Due(_) => State::Stopped,
            Life::Running(_) => State::Running,
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

/// How a process ended, from what the system says; none if it ended as it should.
///
/// * `is_in_order`: whether it had said that it was done, or was asked to end.
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
    fn who_ends_well_without_being_done_and_unasked_has_failed() {
        let well = ExitStatus::from_raw(0);
        assert_eq!(death_of(well, true), None);
        let death = death_of(well, false).unwrap();
        assert_eq!(death, Death::Exit { status: 0 });
        let said = "ended with status 0 without having finished";
        assert_eq!(death.to_string(), said);
        let (killed, failed) = (ExitStatus::from_raw(15), ExitStatus::from_raw(1 << 8));
        for in_order in [true, false] {
            let deaths = [killed, failed].map(|it| death_of(it, in_order));
            let expected = [Death::Signal { number: 15 }, Death::Exit { status: 1 }];
            assert_eq!(deaths, expected.map(Some));
        }
    }

    #[test]
    fn the_work_of_a_turn_is_what_was_used_until_the_next() {
        let mut work = Work::default();
        let millis = Duration::from_millis;
        // The start is no turn, whatever it took.
        work.note(900, true, true);
        work.note(1000, false, false);
        assert_eq!((work.since_turn, work.longest), (millis(100), millis(0)));
        work.note(1080, true, false);
        assert_eq!((work.since_turn, work.longest), (millis(0), millis(180)));
        work.note(1100, true, false);
        assert_eq!((work.since_turn, work.longest), (millis(0), millis(180)));
    }

    #[test]
    fn the_clock_of_processor_time_may_run_over() {
        let mut work = Work::default();
        work.note(u32::MAX - 9, true, true);
        work.note(20, false, false);
        assert_eq!(work.since_turn, Duration::from_millis(30));
    }
}
