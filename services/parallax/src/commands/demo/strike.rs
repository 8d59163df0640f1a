//! The fault on purpose: one camera's process is killed once, and what is heard of it afterwards.

use std::io;

use supervise::Event;

/// A process that is to be killed, or has been.
#[derive(Debug)]
pub(super) struct Strike {
    /// The process.
    process: String,
    /// Its camera.
    camera: String,
    /// Once there is a result of this frame.
    at_frame: u64,
    /// While it runs.
    pid: Option<u32>,
    /// What happened, nanoseconds of the clock of the run.
    times: Times,
}

/// When a killed process was killed, missed, and started again, nanoseconds (`runtime::now_nanos`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Times {
    /// It was killed.
    pub killed: Option<u64>,
    /// The supervisor noticed.
    pub noticed: Option<u64>,
    /// It was started again.
    pub started: Option<u64>,
    /// It said that it has sent a frame.
    pub heard: Option<u64>,
}

impl Strike {
    /// * `view`: whose camera is to be killed.
    /// * `at_frame`: once there is a result of this frame.
    pub(super) fn new(view: usize, camera: &str, at_frame: f64) -> Self {
        Self {
            process: format!("capture-{view}"),
            camera: camera.to_owned(),
            at_frame: at_frame as u64,
            pid: None,
            times: Times::default(),
        }
    }

    /// What happened.
    pub(super) fn times(&self) -> Times {
        self.times
    }

    /// Takes note of what the supervisor tells, kills when it is time, and says so.
    ///
    /// * `now`: `runtime::now_nanos`.
    /// * `kill`: ends the process of a number.
    pub(super) fn note(
        &mut self,
        event: &Event<'_>,
        now: u64,
        kill: impl FnOnce(u32) -> io::Result<()>,
    ) -> Option<String> {
        let since = |killed: u64| now.saturating_sub(killed) / 1_000_000;
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
            Event::Health { process, health } if process == self.process => {
                let killed = self.times.killed?;
                let is_back = health.epoch > 0 && health.n_sent > 0 && self.times.heard.is_none();
                is_back.then(|| {
                    self.times.heard = Some(now);
                    format!(
                        "{} sends again, {} ms after it was killed",
                        self.camera,
                        since(killed)
                    )
                })
            }
            Event::Health {
                process: "triangulate",
                health,
            } => {
                let is_time = health.n_sent > 0 && health.last_frame >= self.at_frame;
                let pid = self
                    .pid
                    .filter(|_| is_time && self.times.killed.is_none())?;
                Some(match kill(pid) {
                    Ok(()) => {
                        self.times.killed = Some(now);
                        format!(
                            "killing the process of {} ({}, process {pid}) on purpose",
                            self.camera, self.process
                        )
                    }
                    Err(error) => format!("cannot kill {}: {error}", self.process),
                })
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use messages::Health;
    use supervise::Death;

    use super::*;

    const MS: u64 = 1_000_000;

    /// Tells a strike of camera 1 something at a time; which process was killed, and what was said.
    fn tell(strike: &mut Strike, event: &Event<'_>, ms: u64) -> (Option<u32>, Option<String>) {
        let mut killed = None;
        let said = strike.note(event, ms * MS, |pid| {
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
        let mut strike = Strike::new(1, "c2", 10.0);
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
        let mut strike = Strike::new(0, "c1", 0.0);
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
}
