//! The fault on purpose: one process is killed or stopped once, and what is heard of it afterwards.

use std::io;

use messages::Health;
use supervise::Event;

/// What is done to a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blow {
    /// It ends at once, as by a crash.
    Kill,
    /// It stands still from then on.
    Stop,
    /// It computes for ever from then on, which its source makes it do.
    Spin,
}

impl Blow {
    /// Deals it to the process of a number.
    pub(crate) fn deal(self, pid: u32) -> io::Result<()> {
        match self {
            Self::Kill => runtime::kill(pid),
            Self::Stop => runtime::freeze(pid),
            Self::Spin => Ok(()),
        }
    }

    /// As one says it of somebody who does it, and of somebody to whom it was done.
    fn words(self) -> [&'static str; 2] {
        match self {
            Self::Kill => ["killing", "killed"],
            Self::Stop => ["stopping", "stopped"],
            Self::Spin => ["letting spin", "sent spinning"],
        }
    }
}

/// A process that is to be killed or stopped, or has been.
#[derive(Debug)]
pub(crate) struct Strike {
    /// What is done to it.
    blow: Blow,
    /// The process.
    process: String,
    /// What people call it.
    called: String,
    /// Once there is a result of this frame; of a process that is to spin, once it has sent it.
    at_frame: u64,
    /// While it runs.
    pid: Option<u32>,
    /// What happened, nanoseconds of the clock of the run.
    times: Times,
}

/// When a process was killed or stopped, missed, and started again, nanoseconds (`runtime::now_nanos`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Times {
    /// It was killed or stopped.
    pub killed: Option<u64>,
    /// The supervisor noticed.
    pub noticed: Option<u64>,
    /// It was started again.
    pub started: Option<u64>,
    /// It said that it has done something in its new life.
    pub heard: Option<u64>,
}

impl Strike {
    /// * `process`: its name in the deployment.
    /// * `at_frame`: once there is a result of this frame.
    pub(crate) fn new(blow: Blow, process: &str, at_frame: f64) -> Self {
        Self {
            blow,
            process: process.to_owned(),
            called: process.to_owned(),
            at_frame: at_frame as u64,
            pid: None,
            times: Times::default(),
        }
    }

    /// The same, called by its camera.
    pub(crate) fn of_camera(self, camera: &str) -> Self {
        Self {
            called: format!("{} ({camera})", self.process),
            ..self
        }
    }

    /// What happened.
    pub(crate) fn times(&self) -> Times {
        self.times
    }

    /// Takes note of what the supervisor tells, strikes when it is time, and says so.
    ///
    /// * `now`: `runtime::now_nanos`.
    /// * `deal`: does it to the process of a number.
    pub(crate) fn note(
        &mut self,
        event: &Event<'_>,
        now: u64,
        deal: impl FnOnce(Blow, u32) -> io::Result<()>,
    ) -> Option<String> {
        match *event {
            Event::Started {
                process,
                pid,
                epoch,
            } if process == self.process => {
                self.pid = Some(pid);
                if epoch > 0 {
                    self.times.started.get_or_insert(now);
                }
                None
            }
            Event::Died { process, .. } | Event::Finished { process }
                if process == self.process =>
            {
                self.pid = None;
                if self.times.killed.is_some() {
                    self.times.noticed.get_or_insert(now);
                }
                None
            }
            Event::Health { process, health } => match self.times.killed {
                None if process == self.judge() => self.strike(health, now, deal),
                Some(killed) if process == self.process => self.hear(health, now, killed),
                _ => None,
            },
            _ => None,
        }
    }

    /// Whose signs of life tell that it is time: those of the process that makes the results, or, of one that will not
    /// get beyond its frame, its own.
    fn judge(&self) -> &str {
        match self.blow {
            Blow::Kill | Blow::Stop => "triangulate",
            Blow::Spin => &self.process,
        }
    }

    /// * `health`: of the process that tells when it is time.
    fn strike(
        &mut self,
        health: &Health,
        now: u64,
        deal: impl FnOnce(Blow, u32) -> io::Result<()>,
    ) -> Option<String> {
        let is_time = health.n_sent > 0 && health.last_frame >= self.at_frame;
        let pid = self.pid.filter(|_| is_time)?;
        let [doing, _] = self.blow.words();
        Some(match deal(self.blow, pid) {
            Ok(()) => {
                self.times.killed = Some(now);
                format!("{doing} {}, process {pid}, on purpose", self.called)
            }
            Err(error) => format!("{doing} {} failed: {error}", self.called),
        })
    }

    /// * `health`: of the process that was struck.
    fn hear(&mut self, health: &Health, now: u64, killed: u64) -> Option<String> {
        if self.times.heard.is_some() || !is_at_work(&self.process, health, 1) {
            return None;
        }
        self.times.heard = Some(now);
        let [_, done] = self.blow.words();
        Some(format!(
            "{} works again, {} ms after it was {done}",
            self.called,
            now.saturating_sub(killed) / 1_000_000
        ))
    }
}

/// Whether a process has done something in this life or a later one; the recorder sends nothing, and only takes in.
///
/// * `life`: how often it had been restarted when it began.
pub(crate) fn is_at_work(process: &str, health: &Health, life: u32) -> bool {
    let has_worked = health.n_sent > 0 || (process == "results" && health.n_received > 0);
    health.epoch >= life && has_worked
}

#[cfg(test)]
mod tests {
    use supervise::Death;

    use super::*;

    const MS: u64 = 1_000_000;

    /// Tells a strike of camera 1 something at a time; which process was killed, and what was said.
    fn tell(strike: &mut Strike, event: &Event<'_>, ms: u64) -> (Option<u32>, Option<String>) {
        let mut killed = None;
        let said = strike.note(event, ms * MS, |_, pid| {
            killed = Some(pid);
            Ok(())
        });
        (killed, said)
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
    fn it_is_killed_once_at_its_frame_and_heard_of_again() {
        let mut strike = Strike::new(Blow::Kill, "capture-1", 10.0).of_camera("c2");
        for (process, pid) in [("capture-0", 70), ("capture-1", 71)] {
            assert_eq!(
                tell(&mut strike, &started(process, pid, 0), 5),
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
            assert_eq!(tell(&mut strike, &event, 100).0, expected, "frame {frame}");
        }
        let died = Event::Died {
            process: "capture-1",
            death: Death::Signal { number: 9 },
        };
        tell(&mut strike, &died, 101);
        tell(&mut strike, &started("capture-1", 75, 1), 210);
        for (epoch, n_sent, at, expected) in
            [(1, 0, 300, false), (1, 2, 900, true), (1, 3, 1000, false)]
        {
            let health = health(epoch, n_sent, 0);
            let event = Event::Health {
                process: "capture-1",
                health: &health,
            };
            let (_, said) = tell(&mut strike, &event, at);
            assert_eq!(said.is_some(), expected, "{said:?}");
        }
        let expected = Times {
            killed: Some(100 * MS),
            noticed: Some(101 * MS),
            started: Some(210 * MS),
            heard: Some(900 * MS),
        };
        assert_eq!(strike.times(), expected);
    }

    #[test]
    fn a_process_that_is_not_there_is_left_alone() {
        let mut strike = Strike::new(Blow::Kill, "capture-0", 0.0);
        tell(&mut strike, &started("capture-0", 70, 0), 1);
        tell(
            &mut strike,
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
        assert_eq!(tell(&mut strike, &event, 3), (None, None));
    }

    #[test]
    fn who_makes_the_results_can_be_struck_as_well() {
        let mut strike = Strike::new(Blow::Stop, "triangulate", 3.0);
        tell(&mut strike, &started("triangulate", 70, 0), 1);
        let mut tell_health = |epoch, n_sent, ms| {
            let health = health(epoch, n_sent, 3);
            let event = Event::Health {
                process: "triangulate",
                health: &health,
            };
            tell(&mut strike, &event, ms)
        };
        let (struck, said) = tell_health(0, 2, 100);
        assert_eq!(struck, Some(70));
        assert_eq!(
            said.unwrap(),
            "stopping triangulate, process 70, on purpose"
        );
        // What it said before it stood still may be heard afterwards.
        assert_eq!(tell_health(0, 3, 110), (None, None));
        let (_, said) = tell_health(1, 1, 400);
        assert_eq!(
            said.unwrap(),
            "triangulate works again, 300 ms after it was stopped"
        );
    }

    #[test]
    fn who_spins_is_known_by_what_it_sent_itself() {
        let mut strike = Strike::new(Blow::Spin, "capture-1", 3.0);
        tell(&mut strike, &started("capture-1", 70, 0), 1);
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
            assert_eq!(tell(&mut strike, &event, 100).0, expected, "{process}");
        }
    }

    #[test]
    fn who_has_sent_nothing_yet_is_not_back_but_for_the_recorder() {
        let received = Health {
            n_received: 4,
            ..health(1, 0, 0)
        };
        assert!(!is_at_work("pose-0", &received, 1));
        assert!(is_at_work("results", &received, 1));
        assert!(!is_at_work("results", &received, 2), "an earlier life");
        assert!(is_at_work("pose-0", &health(2, 1, 0), 1));
    }
}
