//! Injects a fault into one process of a run, and records its detection and the restart.

use std::io;

use messages::Health;
use supervise::Event;

/// A fault of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProcessFault {
    /// The process is killed (SIGKILL), as by a crash.
    Kill,
    /// The process is stopped (SIGSTOP), as if it hung.
    Stop,
    /// The process enters an endless loop. It is started with an option that makes it do so: see `--spin-after`.
    Spin,
}

impl ProcessFault {
    /// Injects the fault into the process with this id; does nothing for [`Self::Spin`].
    pub(crate) fn inject(self, pid: u32) -> io::Result<()> {
        match self {
            Self::Kill => runtime::kill(pid),
            Self::Stop => runtime::freeze(pid),
            Self::Spin => Ok(()),
        }
    }

    /// Returns the fault as a present and as a past participle, for messages.
    fn participles(self) -> [&'static str; 2] {
        match self {
            Self::Kill => ["killing", "killed"],
            Self::Stop => ["stopping", "stopped"],
            Self::Spin => ["starting an endless loop in", "put into an endless loop"],
        }
    }
}

/// Injects a fault into a process at a given frame.
#[derive(Debug)]
pub(crate) struct Injector {
    /// The fault.
    fault: ProcessFault,
    /// The name of the process.
    process: String,
    /// Name of the process in messages.
    label: String,
    /// Frame after whose result the fault is injected; for `Spin`, the frame after which the process starts its loop.
    at_frame: u64,
    /// The id of the process, while it runs.
    pid: Option<u32>,
    /// The times of the fault so far.
    times: FaultTimes,
}

/// Times of a fault, in nanoseconds (`failure::now_nanos`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct FaultTimes {
    /// Time of the injection.
    pub injected: Option<u64>,
    /// Time at which the supervisor noticed the fault.
    pub noticed: Option<u64>,
    /// Time at which the process was restarted.
    pub restarted: Option<u64>,
    /// Time at which the restarted process reported that it has worked.
    pub recovered: Option<u64>,
}

impl Injector {
    /// * `process`: the name of the process in the deployment.
    /// * `at_frame`: frame after whose result the fault is injected.
    pub(crate) fn new(fault: ProcessFault, process: &str, at_frame: f64) -> Self {
        Self {
            fault,
            process: process.to_owned(),
            label: process.to_owned(),
            at_frame: at_frame as u64,
            pid: None,
            times: FaultTimes::default(),
        }
    }

    /// Adds the name of the process's camera to messages.
    pub(crate) fn with_camera_name(self, camera: &str) -> Self {
        Self {
            label: format!("{} ({camera})", self.process),
            ..self
        }
    }

    /// Returns the times of the fault so far.
    pub(crate) fn times(&self) -> FaultTimes {
        self.times
    }

    /// Handles an event of the supervisor, and injects the fault if it is time. Returns a message about the injection or
    /// the recovery.
    ///
    /// * `now`: current time (`failure::now_nanos`).
    /// * `inject`: injects the fault into the process with this id.
    pub(crate) fn handle(
        &mut self,
        event: &Event<'_>,
        now: u64,
        inject: impl FnOnce(ProcessFault, u32) -> io::Result<()>,
    ) -> Option<String> {
        match *event {
            Event::Started {
                process,
                pid,
                epoch,
            } if process == self.process => {
                self.pid = Some(pid);
                if epoch > 0 {
                    self.times.restarted.get_or_insert(now);
                }
                None
            }
            Event::Died { process, .. } | Event::Finished { process }
                if process == self.process =>
            {
                self.pid = None;
                if self.times.injected.is_some() {
                    self.times.noticed.get_or_insert(now);
                }
                None
            }
            Event::Health { process, health } => match self.times.injected {
                None if process == self.trigger() => self.inject_if_due(health, now, inject),
                Some(injected) if process == self.process => {
                    self.note_recovery(health, now, injected)
                }
                _ => None,
            },
            _ => None,
        }
    }

    /// Returns the process whose health messages determine when the fault is injected. This is usually the process that makes the results.
    /// For `Spin`, it is the process with the fault, which stops working after the given frame.
    fn trigger(&self) -> &str {
        match self.fault {
            ProcessFault::Kill | ProcessFault::Stop => "triangulate",
            ProcessFault::Spin => &self.process,
        }
    }

    /// * `health`: the health message of the trigger process.
    fn inject_if_due(
        &mut self,
        health: &Health,
        now: u64,
        inject: impl FnOnce(ProcessFault, u32) -> io::Result<()>,
    ) -> Option<String> {
        let is_time = health.n_sent > 0 && health.last_frame >= self.at_frame;
        let pid = self.pid.filter(|_| is_time)?;
        let [doing, _] = self.fault.participles();
        Some(match inject(self.fault, pid) {
            Ok(()) => {
                self.times.injected = Some(now);
                format!("{doing} {}, process {pid}, on purpose", self.label)
            }
            Err(error) => format!("{doing} {} failed: {error}", self.label),
        })
    }

    /// * `health`: the health message of the process with the fault.
    fn note_recovery(&mut self, health: &Health, now: u64, injected: u64) -> Option<String> {
        if self.times.recovered.is_some() || !has_worked(&self.process, health, 1) {
            return None;
        }
        self.times.recovered = Some(now);
        let [_, done] = self.fault.participles();
        Some(format!(
            "{} works again, {} ms after it was {done}",
            self.label,
            now.saturating_sub(injected) / 1_000_000
        ))
    }
}

/// Returns true if a process has worked in this epoch or a later one. It has worked if it has sent messages or, for `results`, received
/// some.
pub(crate) fn has_worked(process: &str, health: &Health, epoch: u32) -> bool {
    let has_messages = health.n_sent > 0 || (process == "results" && health.n_received > 0);
    health.epoch >= epoch && has_messages
}

#[cfg(test)]
mod tests {
    use supervise::Death;

    use super::*;

    const MS: u64 = 1_000_000;

    /// Handles an event at the given time, and returns the id of the process with the fault, and the message.
    fn handle_at(
        injector: &mut Injector,
        event: &Event<'_>,
        ms: u64,
    ) -> (Option<u32>, Option<String>) {
        let mut target = None;
        let message = injector.handle(event, ms * MS, |_, pid| {
            target = Some(pid);
            Ok(())
        });
        (target, message)
    }

    fn started(process: &str, pid: u32, epoch: u32) -> Event<'_> {
        Event::Started {
            process,
            pid,
            epoch,
        }
    }

    fn health(epoch: u32, n_sent: u64, last_frame: u64) -> Health {
        Health {
            epoch,
            n_sent,
            last_frame,
            ..Health::default()
        }
    }

    #[test]
    fn a_process_is_killed_once_at_its_frame_and_its_recovery_is_reported() {
        let mut injector =
            Injector::new(ProcessFault::Kill, "capture-1", 10.0).with_camera_name("c2");
        for (process, pid) in [("capture-0", 70), ("capture-1", 71)] {
            assert_eq!(
                handle_at(&mut injector, &started(process, pid, 0), 5),
                (None, None)
            );
        }
        for (n_sent, frame, expected) in [
            (0, 99, None),
            (3, 9, None),
            (4, 10, Some(71)),
            (5, 11, None),
        ] {
            let health = health(0, n_sent, frame);
            let event = Event::Health {
                process: "triangulate",
                health: &health,
            };
            assert_eq!(
                handle_at(&mut injector, &event, 100).0,
                expected,
                "frame {frame}"
            );
        }
        let died = Event::Died {
            process: "capture-1",
            death: Death::Signal { number: 9 },
        };
        handle_at(&mut injector, &died, 101);
        handle_at(&mut injector, &started("capture-1", 75, 1), 210);
        for (epoch, n_sent, at, expected) in
            [(1, 0, 300, false), (1, 2, 900, true), (1, 3, 1000, false)]
        {
            let health = health(epoch, n_sent, 0);
            let event = Event::Health {
                process: "capture-1",
                health: &health,
            };
            let (_, message) = handle_at(&mut injector, &event, at);
            assert_eq!(message.is_some(), expected, "{message:?}");
        }
        let expected = FaultTimes {
            injected: Some(100 * MS),
            noticed: Some(101 * MS),
            restarted: Some(210 * MS),
            recovered: Some(900 * MS),
        };
        assert_eq!(injector.times(), expected);
    }

    #[test]
    fn no_fault_is_injected_into_a_finished_process() {
        let mut injector = Injector::new(ProcessFault::Kill, "capture-0", 0.0);
        handle_at(&mut injector, &started("capture-0", 70, 0), 1);
        handle_at(
            &mut injector,
            &Event::Finished {
                process: "capture-0",
            },
            2,
        );
        let health = health(0, 1, 5);
        let event = Event::Health {
            process: "triangulate",
            health: &health,
        };
        assert_eq!(handle_at(&mut injector, &event, 3), (None, None));
    }

    #[test]
    fn a_fault_can_be_injected_into_triangulate() {
        let mut injector = Injector::new(ProcessFault::Stop, "triangulate", 3.0);
        handle_at(&mut injector, &started("triangulate", 70, 0), 1);
        let mut health_at = |epoch, n_sent, ms| {
            let health = health(epoch, n_sent, 3);
            let event = Event::Health {
                process: "triangulate",
                health: &health,
            };
            handle_at(&mut injector, &event, ms)
        };
        let (target, message) = health_at(0, 2, 100);
        assert_eq!(target, Some(70));
        assert_eq!(
            message.unwrap(),
            "stopping triangulate, process 70, on purpose"
        );
        // A health message from before the stop may arrive afterwards.
        assert_eq!(health_at(0, 3, 110), (None, None));
        let (_, message) = health_at(1, 1, 400);
        assert_eq!(
            message.unwrap(),
            "triangulate works again, 300 ms after it was stopped"
        );
    }

    #[test]
    fn an_endless_loop_is_triggered_by_the_process_itself() {
        let mut injector = Injector::new(ProcessFault::Spin, "capture-1", 3.0);
        handle_at(&mut injector, &started("capture-1", 70, 0), 1);
        for (process, frame, expected) in [
            ("triangulate", 3, None),
            ("capture-1", 2, None),
            ("capture-1", 3, Some(70)),
        ] {
            let health = health(0, 4, frame);
            let event = Event::Health {
                process,
                health: &health,
            };
            assert_eq!(
                handle_at(&mut injector, &event, 100).0,
                expected,
                "{process}"
            );
        }
    }

    #[test]
    fn a_process_counts_as_working_after_its_first_message() {
        let received = Health {
            n_received: 4,
            ..health(1, 0, 0)
        };
        assert!(!has_worked("pose-0", &received, 1));
        assert!(has_worked("results", &received, 1));
        assert!(!has_worked("results", &received, 2), "an earlier epoch");
        assert!(has_worked("pose-0", &health(2, 1, 0), 1));
    }
}
