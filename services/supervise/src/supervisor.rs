//! The loop that starts, watches, restarts and stops processes.

use core::time::Duration;
use std::io;
use std::time::Instant;

use failure::{ExitKind, Fault, Stop};
use messages::{Health, Metrics, topic};
use runtime::{
    Bus, BusError, Child, Cleaner, Launch, LockError, Losses, PortError, PreflightError,
    SUPERVISOR, preflight, wait_for_any,
};

use crate::stall::Stall;
use crate::watch::{Phase, Sequel, Watch, death_of};
use crate::{Death, Event, Outcome, Plan, Role};

/// Longest sleep of the supervisor, and so the longest delay until a hang or a due restart is noticed.
const TURN: Duration = Duration::from_millis(50);
/// If one of its iterations took this long, the supervisor itself was suspended and could not receive heartbeats.
const ASLEEP: Duration = Duration::from_secs(2);
/// Longest time without an answer from shared memory. The transport may wait forever if one of its files was truncated.
const LONGEST_STALL: Duration = Duration::from_mins(1);
/// Message if shared memory does not answer in this time.
const STALLED: &str = "error: shared memory of the deployment has not answered the supervisor for a minute\n  hint: another program has \
                       filled /dev/shm, or has truncated or changed files in it; free some space in /dev/shm; `parallax clean` removes the \
                       leftovers\n";

/// Error of a failed run.
#[derive(Debug, thiserror::Error)]
pub enum SuperviseError {
    /// The deployment cannot be locked.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// There is not enough memory, or too few open files.
    #[error(transparent)]
    Preflight(#[from] PreflightError),
    /// The topics of the deployment cannot be created.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A topic of heartbeats cannot be subscribed to.
    #[error(transparent)]
    Port(#[from] PortError),
    /// A process reports that its input is wrong.
    #[error("{process} cannot work: {message}")]
    Unusable {
        /// Name of the process.
        process: String,
        /// Exit status of the process.
        kind: ExitKind,
        /// Output of the process.
        message: String,
    },
    /// An essential process failed too often.
    #[error("{process} {death}, and was given up after {restarts} restarts\n{message}")]
    GivenUp {
        /// Name of the process.
        process: String,
        /// Cause of the last death.
        death: Death,
        /// Number of restarts.
        restarts: u32,
        /// End of the output.
        message: String,
    },
    /// The child processes cannot be watched.
    #[error("cannot watch the processes")]
    Watch(#[source] io::Error),
}

impl Fault for SuperviseError {
    fn kind(&self) -> ExitKind {
        match self {
            Self::Lock(error) => error.kind(),
            Self::Preflight(error) => error.kind(),
            Self::Bus(error) => error.kind(),
            Self::Port(error) => error.kind(),
            Self::Unusable { kind, .. } => *kind,
            Self::GivenUp { .. } | Self::Watch(_) => ExitKind::Run,
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::Lock(error) => error.hint(),
            Self::Preflight(error) => error.hint(),
            Self::Bus(error) => error.hint(),
            Self::Port(_) | Self::Unusable { .. } | Self::GivenUp { .. } | Self::Watch(_) => None,
        }
    }
}

/// Time after which the stop request is repeated. The repetition comes soon enough to count as the same request (`failure::Stop`).
const REPEAT_STOP: core::ops::Range<Duration> =
    Duration::from_millis(100)..Duration::from_millis(300);

/// Runs a deployment until all its processes have finished, `stop` is requested, or it fails.
///
/// A process has finished when its heartbeats report so. Processes are stopped only when all have finished, so that the
/// last message of each remains available to a restarted receiver. If a process ends without having finished and
/// without a stop request, it has failed, whatever its exit status.
///
/// Afterwards no process, file or shared memory of the deployment is left, whatever the outcome. Call this function from
/// a thread that lives as long as the run, because the child processes end with the thread.
///
/// There is one exception: if shared memory does not answer for a minute, this process ends at once, with a message and the exit
/// status of [`ExitKind::Run`]. Files may then be left.
///
/// * `on_event`: called for every event. It must not take long.
///
/// # Errors
///
/// Fails with [`SuperviseError`] if the run fails.
pub fn run(
    plan: &Plan,
    stop: &Stop,
    on_event: &mut dyn FnMut(Event<'_>),
) -> Result<Outcome, SuperviseError> {
    runtime::raise_file_limit();
    let stall = Stall::watch(LONGEST_STALL, || failure::end_process(STALLED))
        .map_err(SuperviseError::Watch)?;
    let on_event = &mut |event: Event<'_>| stall.outside(|| on_event(event));
    // These values are dropped in reverse order: ports, topics, bus, and finally the lock, which removes all files.
    let lock = plan.namespace.acquire()?;
    preflight(&plan.topics)?;
    let bus = Bus::open(&plan.namespace, SUPERVISOR, stop)?;
    let _topics = bus.create_topics(&plan.topics)?;
    // The description tells other programs that all topics exist.
    lock.describe(&plan.description)?;
    let mut waiter = bus.waiter();
    let now = Instant::now();
    let mut watches = Vec::new();
    for spec in &plan.processes {
        let signs = bus.subscriber::<Health>(&topic::health(&spec.name), &mut waiter)?;
        let metrics = bus.subscriber::<Metrics>(&topic::metrics(&spec.name), &mut waiter)?;
        watches.push(Watch::new(spec.clone(), signs, metrics, now));
    }
    let mut supervisor = Supervisor {
        plan,
        stop,
        bus: &bus,
        watches,
        cleaner: Cleaner::default(),
        cleaned: now,
        stall: &stall,
        on_event,
    };
    let result = supervisor.watch();
    supervisor.shut_down();
    result?;
    Ok(Outcome {
        processes: supervisor.watches.iter().map(Watch::outcome).collect(),
        interrupted: stop.is_requested(),
    })
}

struct Supervisor<'a> {
    plan: &'a Plan,
    stop: &'a Stop,
    bus: &'a Bus,
    watches: Vec<Watch>,
    cleaner: Cleaner,
    cleaned: Instant,
    stall: &'a Stall,
    on_event: &'a mut dyn FnMut(Event<'_>),
}

impl Supervisor<'_> {
    fn watch(&mut self) -> Result<(), SuperviseError> {
        let mut last_turn = Instant::now();
        while !self.stop.is_requested() {
            let now = Instant::now();
            if now.saturating_duration_since(last_turn) > ASLEEP {
                self.watches.iter_mut().for_each(|watch| watch.restart_timers(now));
            }
            last_turn = now;
            for index in 0..self.watches.len() {
                self.start_if_due(index, now)?;
                self.receive(index, now);
                self.reap(index, now)?;
            }
            self.dismiss(now);
            if self.is_done(now) {
                break;
            }
            if now.saturating_duration_since(self.cleaned) > self.plan.policy.clean_period {
                self.clean(now);
            }
            self.sleep(self.until_due(), Some(self.stop))?;
        }
        Ok(())
    }

    /// Stops processes that wait for messages, if no process is left that sends them.
    fn dismiss(&mut self, now: Instant) {
        for index in 0..self.watches.len() {
            let watch = &self.watches[index];
            let is_lost = |name: &String| {
                let mut others = self.watches.iter();
                others.any(|other| other.spec.name == *name && other.is_lost())
            };
            let senders = &watch.spec.senders;
            let is_idle = !watch.is_finished() && watch.is_idle(&self.plan.policy, now);
            if watch.is_dismissed || !is_idle || senders.is_empty() || !senders.iter().all(is_lost)
            {
                continue;
            }
            let watch = &mut self.watches[index];
            watch.is_dismissed = true;
            if let Some(child) = watch.child() {
                child.terminate();
            }
            (self.on_event)(Event::Dismissed {
                process: &watch.spec.name,
            });
        }
    }

    /// Returns the time until the next restart.
    fn until_due(&self) -> Duration {
        let now = Instant::now();
        self.watches
            .iter()
            .filter_map(|watch| match watch.phase {
                Phase::Due(at) => Some(at.saturating_duration_since(now)),
                Phase::Running(_) | Phase::Ended(_) | Phase::GivenUp => None,
            })
            .fold(TURN, Duration::min)
    }

    fn sleep(&self, longest: Duration, stop: Option<&Stop>) -> Result<(), SuperviseError> {
        self.stall.turn();
        let children: Vec<&Child> = self.watches.iter().filter_map(Watch::child).collect();
        wait_for_any(&children, stop, longest).map_err(SuperviseError::Watch)
    }

    fn start_if_due(&mut self, index: usize, now: Instant) -> Result<(), SuperviseError> {
        let watch = &mut self.watches[index];
        let Phase::Due(at) = watch.phase else {
            return Ok(());
        };
        if now < at {
            return Ok(());
        }
        let launch = Launch {
            namespace: self.plan.namespace.clone(),
            process: watch.spec.name.clone(),
            session: self.plan.session,
            epoch: watch.epoch,
            delivery: self.plan.delivery,
            supervisor: Some(std::process::id()),
            log: self.plan.log,
            scheduling: watch.spec.scheduling.clone(),
        };
        let mut args = vec!["service".into(), watch.spec.service.clone().into()];
        args.extend(launch.to_args());
        args.extend(watch.spec.args.iter().cloned());
        match Child::start_given(&self.plan.executable, &args, &self.plan.given) {
            Ok(child) => {
                (self.on_event)(Event::Started {
                    process: &watch.spec.name,
                    pid: child.pid(),
                    epoch: watch.epoch,
                });
                watch.begin(child, now);
                Ok(())
            }
            Err(error) => {
                watch.note_line(&format!(
                    "error: {}: {error}",
                    self.plan.executable.display()
                ));
                self.died(index, Death::NotStarted, now)
            }
        }
    }

    /// Reads the output, heartbeats and metrics of a process.
    fn receive(&mut self, index: usize, now: Instant) {
        let watch = &mut self.watches[index];
        if let Phase::Running(child) = &mut watch.phase {
            match child.read_lines() {
                Ok(lines) => {
                    for text in &lines {
                        watch.note_line(text);
                        (self.on_event)(Event::Line {
                            process: &watch.spec.name,
                            text,
                        });
                    }
                }
                Err(error) => {
                    tracing::warn!(process = watch.spec.name, %error, "cannot read the output of the process");
                }
            }
        }
        match watch.heartbeats.latest() {
            Ok(Some(health)) => {
                if watch.note_health(&health, self.plan.session, now) {
                    (self.on_event)(Event::Health {
                        process: &watch.spec.name,
                        health: &health,
                    });
                }
            }
            Ok(None) => {}
            Err(error) => {
                tracing::warn!(process = watch.spec.name, %error, "cannot receive the heartbeats of the process");
            }
        }
        match watch.metrics.latest() {
            Ok(metrics) => metrics.iter().for_each(|message| watch.note_metrics(message)),
            Err(error) => {
                tracing::warn!(process = watch.spec.name, %error, "cannot receive the metrics of the process");
            }
        }
    }

    /// Handles the end of a process. Kills the process if it hangs.
    fn reap(&mut self, index: usize, now: Instant) -> Result<(), SuperviseError> {
        let watch = &mut self.watches[index];
        let overdue = watch.overdue(&self.plan.policy, now);
        let Phase::Running(child) = &mut watch.phase else {
            return Ok(());
        };
        if let Some(death) = overdue {
            child.kill();
            return self.died(index, death, now);
        }
        let Some(status) = child.try_wait().map_err(SuperviseError::Watch)? else {
            return Ok(());
        };
        // Receives the last messages of the process.
        self.receive(index, now);
        let watch = &mut self.watches[index];
        // A process may end before it is told to, if it received the same signal as the supervisor.
        let is_in_order =
            watch.reports_finished() || watch.is_dismissed || self.stop.is_requested();
        if let Some(death) = death_of(status, is_in_order) {
            return self.died(index, death, now);
        }
        watch.end();
        (self.on_event)(Event::Finished {
            process: &watch.spec.name,
        });
        Ok(())
    }

    fn died(&mut self, index: usize, death: Death, now: Instant) -> Result<(), SuperviseError> {
        let watch = &mut self.watches[index];
        let process = watch.spec.name.as_str();
        (self.on_event)(Event::Died { process, death });
        // Dropping the child waits for its end. The clean-up needs this.
        match watch.die(death, &self.plan.policy, now) {
            Sequel::Restart(pause) => {
                let process = watch.spec.name.as_str();
                (self.on_event)(Event::Restarting { process, pause });
            }
            Sequel::GiveUp => {
                let process = watch.spec.name.as_str();
                if let Err(error) = Losses::of(&self.plan.namespace).note(process) {
                    tracing::warn!(process, %error, "senders will wait a long time for the process that was given up");
                }
                (self.on_event)(Event::GivenUp {
                    process: &watch.spec.name,
                    restarts: watch.epoch,
                });
                self.check_needed(index, death)?;
            }
            Sequel::Fail(kind) => {
                return Err(SuperviseError::Unusable {
                    process: watch.spec.name.clone(),
                    kind,
                    message: watch.message(),
                });
            }
        }
        self.clean(now);
        Ok(())
    }

    /// Returns an error if the run cannot continue without a process.
    fn check_needed(&self, index: usize, death: Death) -> Result<(), SuperviseError> {
        let watch = &self.watches[index];
        let needed = match watch.spec.role {
            Role::Essential => true,
            Role::Optional => false,
            Role::Redundant => self
                .watches
                .iter()
                .filter(|other| other.spec.service == watch.spec.service)
                .all(Watch::is_given_up),
        };
        if !needed {
            return Ok(());
        }
        Err(SuperviseError::GivenUp {
            process: watch.spec.name.clone(),
            death,
            restarts: watch.epoch,
            message: watch.message(),
        })
    }

    /// Returns true if all processes have finished. Also returns true if one process was given up or restarted and the other processes only
    /// wait, because they may never receive the end of the stream.
    fn is_done(&self, now: Instant) -> bool {
        let was_lost = |watch: &Watch| watch.is_given_up() || watch.epoch > 0;
        let may_miss_end =
            self.watches.iter().any(was_lost) && self.watches.iter().any(Watch::is_finished);
        self.watches.iter().all(|watch| {
            watch.is_finished()
                || watch.is_given_up()
                || (may_miss_end && watch.is_idle(&self.plan.policy, now))
        })
    }

    fn clean(&mut self, now: Instant) {
        self.cleaned = now;
        let cleaned = self.cleaner.clean(self.bus);
        if cleaned > 0 {
            tracing::debug!(cleaned, "cleaned up after dead processes");
        }
    }

    /// Stops all processes, and kills those that do not end.
    fn shut_down(&mut self) {
        (self.on_event)(Event::Stopping);
        self.watches.iter().filter_map(Watch::child).for_each(Child::terminate);
        let begin = Instant::now();
        let (mut is_repeated, mut is_late) = (false, false);
        while self.watches.iter().any(|watch| watch.child().is_some()) {
            let now = Instant::now();
            let waited = now.saturating_duration_since(begin);
            // Two signals that arrive at the same time may merge into one, which may name the other process as its sender. Therefore, the
            // signal is repeated.
            if !is_repeated && REPEAT_STOP.contains(&waited) {
                is_repeated = true;
                self.watches.iter().filter_map(Watch::child).for_each(Child::terminate);
            }
            for index in 0..self.watches.len() {
                self.receive(index, now);
                self.release(index, waited);
            }
            if !is_late && waited >= self.plan.policy.grace {
                is_late = true;
                for watch in self.watches.iter().filter(|watch| watch.child().is_some()) {
                    (self.on_event)(Event::Awaited {
                        process: &watch.spec.name,
                    });
                }
            }
            if let Err(error) = self.sleep(TURN, None) {
                tracing::warn!(%error, "cannot wait for the processes to end");
            }
        }
        self.clean(Instant::now());
    }

    /// Releases a process that has ended, or whose time is over.
    ///
    /// * `waited`: time since the stop request.
    fn release(&mut self, index: usize, waited: Duration) {
        let watch = &mut self.watches[index];
        let grace = watch.grace(&self.plan.policy, Instant::now());
        let Phase::Running(child) = &mut watch.phase else {
            return;
        };
        if matches!(child.try_wait(), Ok(None)) {
            if waited < grace {
                return;
            }
            (self.on_event)(Event::Killed {
                process: &watch.spec.name,
                waited,
            });
        }
        self.receive(index, Instant::now());
        self.watches[index].end();
    }
}
