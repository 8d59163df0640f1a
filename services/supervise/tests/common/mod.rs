//! Runs a deployment of dummy processes under the supervisor and records the events.
#![allow(dead_code, reason = "every test file uses a part of it")]

use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;

use failure::Stop;
use messages::FrameHeader;
use runtime::{Delivery, Limits, Namespace, Scheduling, TopicPlan, process_topics};
use supervise::{Death, Event, Outcome, Plan, Policy, ProcessSpec, Role, SuperviseError};
use tracing::Level;

/// If a run takes longer than this, it is stuck.
const WATCHDOG: Duration = Duration::from_mins(2);

/// A recorded event.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Recorded {
    Started(String, u32, u32),
    Line(String, String),
    Finished(String),
    Died(String, Death),
    Restarting(String, Duration),
    GivenUp(String, u32),
    Dismissed(String),
    Stopping,
    Awaited(String),
    Killed(String),
}

/// A deployment in a folder of its own.
pub(crate) struct Case {
    pub(crate) plan: Plan,
    base: tempfile::TempDir,
}

/// The events and the result of a run.
pub(crate) struct Run {
    pub(crate) events: Vec<Recorded>,
    pub(crate) result: Result<Outcome, SuperviseError>,
}

impl Case {
    /// Creates a deployment.
    ///
    /// * `processes`: name, behaviour and role of each process.
    pub(crate) fn new(delivery: Delivery, processes: &[(&str, &str, Role)]) -> Self {
        let base = tempfile::Builder::new().prefix("px").tempdir_in("/dev/shm").unwrap();
        let frames = TopicPlan::slices::<u8, FrameHeader>(
            "data".to_owned(),
            delivery,
            Limits::new(2, 1, 1),
            100_000,
        );
        let specs = processes.iter().map(|&(name, behaviour, role)| ProcessSpec {
            name: name.to_owned(),
            service: "dummy".to_owned(),
            args: behaviour.split(' ').map(Into::into).collect(),
            role,
            senders: Vec::new(),
            scheduling: Scheduling::default(),
            most_work: None,
            completes_files: false,
        });
        let health = processes.iter().flat_map(|&(name, _, _)| process_topics(name));
        let plan = Plan {
            executable: env!("CARGO_BIN_EXE_supervise-dummy").into(),
            given: Vec::new(),
            description: Vec::new(),
            namespace: Namespace::below("t", base.path()).unwrap(),
            session: 42,
            delivery,
            topics: [frames].into_iter().chain(health).collect(),
            processes: specs.collect(),
            policy: Policy {
                first_pause: Duration::from_millis(20),
                silence_limit: Duration::from_secs(3),
                hang_limit: Duration::from_secs(6),
                idle_limit: Duration::from_secs(2),
                grace: Duration::from_secs(10),
                ..Policy::default()
            },
            log: Level::WARN,
        };
        Self { plan, base }
    }

    /// Runs the deployment to the end. `react` is called for every event, and may stop the run.
    pub(crate) fn run(&self, mut react: impl FnMut(&Recorded, &Stop)) -> Run {
        let stop = Stop::new().unwrap();
        let watchdog = Watchdog::new(&stop);
        let mut events = Vec::new();
        let result = supervise::run(&self.plan, &stop, &mut |event| {
            if let Some(event) = note(&event) {
                react(&event, &stop);
                events.push(event);
            }
        });
        assert!(!watchdog.has_fired(), "stuck: {events:#?}");
        self.assert_nothing_left();
        Run { events, result }
    }

    /// Returns the parent directory of the deployment's root.
    pub(crate) fn base(&self) -> &Path {
        self.base.path()
    }

    fn assert_nothing_left(&self) {
        let prefix = self.plan.namespace.prefix();
        let left: Vec<_> = std::fs::read_dir("/dev/shm")
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.starts_with(prefix))
            .collect();
        assert_eq!(left, Vec::<String>::new(), "left in shared memory");
        assert!(!self.plan.namespace.root().exists(), "left in the root");
        let left = std::fs::read_dir(self.base.path()).unwrap().count();
        assert_eq!(left, 0, "left beside the root");
    }
}

impl Drop for Case {
    /// Removes the files that a failed test left.
    fn drop(&mut self) {
        drop(self.plan.namespace.acquire());
    }
}

impl Run {
    pub(crate) fn outcome(&self) -> &Outcome {
        self.result.as_ref().unwrap()
    }

    /// Returns the frames that a receiver received, each with the epoch of its sender.
    pub(crate) fn got(&self, receiver: &str) -> Vec<(u32, u64)> {
        self.lines(receiver)
            .filter_map(|line| {
                let (epoch, frame) = line.strip_prefix("got ")?.split_once(' ')?;
                Some((epoch.parse().unwrap(), frame.parse().unwrap()))
            })
            .collect()
    }

    pub(crate) fn lines<'a>(&'a self, process: &'a str) -> impl Iterator<Item = &'a str> {
        self.events.iter().filter_map(move |event| match event {
            Recorded::Line(name, text) if name == process => Some(text.as_str()),
            _ => None,
        })
    }

    pub(crate) fn deaths(&self, process: &str) -> Vec<Death> {
        let of = |event: &Recorded| match event {
            Recorded::Died(name, death) if name == process => Some(*death),
            _ => None,
        };
        self.events.iter().filter_map(of).collect()
    }

    pub(crate) fn pids(&self, process: &str) -> Vec<u32> {
        let of = |event: &Recorded| match event {
            Recorded::Started(name, pid, _) if name == process => Some(*pid),
            _ => None,
        };
        self.events.iter().filter_map(of).collect()
    }
}

/// Sends a signal.
pub(crate) fn kill(signal: &str, pid: u32) {
    let status = Command::new("sh").args(["-c", &format!("kill {signal} {pid}")]).status();
    assert!(status.unwrap().success(), "kill {signal} {pid}");
}

/// Returns true if a process is running: it exists and is not a zombie.
pub(crate) fn is_alive(pid: u32) -> bool {
    let line = std::fs::read(Path::new("/proc").join(pid.to_string()).join("cmdline"));
    line.is_ok_and(|line| !line.is_empty())
}

fn note(event: &Event<'_>) -> Option<Recorded> {
    Some(match event {
        Event::Started {
            process,
            pid,
            epoch,
        } => Recorded::Started((*process).to_owned(), *pid, *epoch),
        Event::Line { process, text } => Recorded::Line((*process).to_owned(), (*text).to_owned()),
        Event::Finished { process } => Recorded::Finished((*process).to_owned()),
        Event::Died { process, death } => Recorded::Died((*process).to_owned(), *death),
        Event::Restarting { process, pause } => Recorded::Restarting((*process).to_owned(), *pause),
        Event::GivenUp { process, restarts } => Recorded::GivenUp((*process).to_owned(), *restarts),
        Event::Dismissed { process } => Recorded::Dismissed((*process).to_owned()),
        Event::Stopping => Recorded::Stopping,
        Event::Awaited { process } => Recorded::Awaited((*process).to_owned()),
        Event::Killed { process, .. } => Recorded::Killed((*process).to_owned()),
        Event::Health { .. } => return None,
    })
}

/// Stops a run that is stuck.
struct Watchdog {
    has_fired: Arc<AtomicBool>,
    _over: mpsc::SyncSender<()>,
}

impl Watchdog {
    fn new(stop: &Stop) -> Self {
        let has_fired = Arc::new(AtomicBool::new(false));
        let (over, is_over) = mpsc::sync_channel(0);
        let (bark, stop) = (Arc::clone(&has_fired), stop.clone());
        std::thread::Builder::new()
            .name("watchdog".to_owned())
            .spawn(move || {
                if is_over.recv_timeout(WATCHDOG) == Err(mpsc::RecvTimeoutError::Timeout) {
                    bark.store(true, Ordering::Release);
                    stop.request();
                }
            })
            .unwrap();
        Self {
            has_fired,
            _over: over,
        }
    }

    fn has_fired(&self) -> bool {
        self.has_fired.load(Ordering::Acquire)
    }
}
