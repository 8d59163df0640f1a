//! Kills randomly chosen processes of a run one after the other, and records their restarts.

use std::collections::BTreeMap;
use std::io;

use fastrand::Rng;
use supervise::Event;

use crate::trial::cost::EpochSource;
use crate::trial::injection::{FaultTimes, has_worked};
use crate::trial::results::FrameResult;

/// Kills processes at a fixed interval.
#[derive(Debug)]
pub(super) struct RandomKills {
    random: Rng,
    /// Time between two kills, in nanoseconds.
    period: u64,
    /// Frame whose result ends the kills.
    until_frame: u64,
    /// Time of the next kill; `None` before the first result of the run.
    next_at: Option<u64>,
    is_over: bool,
    /// Process id and epoch of the running processes, by name.
    running: BTreeMap<String, (u32, u32)>,
    kills: Vec<Kill>,
}

/// One kill.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Kill {
    /// Name of the process.
    pub process: String,
    /// Times of the kill and of the restart.
    pub times: FaultTimes,
    /// Epoch of the process after the kill.
    pub epoch: u32,
}

impl Kill {
    /// Returns the downtime, in milliseconds. It ends when the process sends its first message that contributes to a result. For a process
    /// that does not appear in results, the downtime ends when the process reports that it has worked.
    ///
    /// * `session`: the session, which is the time of planning (`failure::now_nanos`).
    pub(super) fn downtime_ms(
        &self,
        source: EpochSource,
        session: u64,
        results: &[FrameResult],
    ) -> Option<f64> {
        let killed = self.times.injected?;
        let ms = |from: u64, to: u64| to.saturating_sub(from) as f64 / 1e6;
        let sent = source.began_ms(self.epoch, results);
        let sent = sent.map(|sent| sent - ms(session, killed));
        sent.or_else(|| Some(ms(killed, self.times.recovered?)))
    }
}

impl RandomKills {
    /// * `period`: the time between two kills, in nanoseconds.
    /// * `until_frame`: frame whose result ends the kills, so that all processes have time to restart.
    pub(super) fn new(seed: u64, period: u64, until_frame: u64) -> Self {
        Self {
            random: Rng::with_seed(seed),
            period,
            until_frame,
            next_at: None,
            is_over: false,
            running: BTreeMap::new(),
            kills: Vec::new(),
        }
    }

    /// Returns all kills so far.
    pub(super) fn kills(&self) -> &[Kill] {
        &self.kills
    }

    /// Handles an event of the supervisor, and kills a process if it is time. Returns a message about the kill.
    ///
    /// * `now`: current time (`failure::now_nanos`).
    /// * `kill`: kills the process with this id.
    pub(super) fn handle(
        &mut self,
        event: &Event<'_>,
        now: u64,
        kill: impl FnOnce(u32) -> io::Result<()>,
    ) -> Option<String> {
        match *event {
            Event::Started {
                process,
                pid,
                epoch,
            } => {
                self.running.insert(process.to_owned(), (pid, epoch));
                if let Some(kill) = self.pending(process) {
                    kill.times.restarted.get_or_insert(now);
                }
            }
            Event::Died { process, .. } | Event::Finished { process } => {
                self.running.remove(process);
                if let Some(kill) = self.pending(process) {
                    kill.times.noticed.get_or_insert(now);
                }
            }
            Event::Health { process, health } => {
                if process == "triangulate" && health.n_sent > 0 {
                    self.next_at.get_or_insert(now + self.period);
                    self.is_over |= health.last_frame >= self.until_frame;
                }
                if let Some(kill) = self.pending(process)
                    && has_worked(process, health, kill.epoch)
                {
                    kill.times.recovered = Some(now);
                }
            }
            Event::Stopping => self.is_over = true,
            _ => {}
        }
        self.kill_if_due(now, kill)
    }

    /// Returns the kill of a process that does not work again yet.
    fn pending(&mut self, process: &str) -> Option<&mut Kill> {
        let mut kills = self.kills.iter_mut();
        kills.find(|kill| kill.process == process && kill.times.recovered.is_none())
    }

    fn kill_if_due(
        &mut self,
        now: u64,
        kill: impl FnOnce(u32) -> io::Result<()>,
    ) -> Option<String> {
        self.next_at.filter(|at| *at <= now && !self.is_over)?;
        let is_away = |name: &str| {
            let mut kills = self.kills.iter();
            kills.any(|kill| kill.process == name && kill.times.recovered.is_none())
        };
        let available: Vec<_> = self.running.iter().filter(|running| !is_away(running.0)).collect();
        let (process, &(pid, epoch)) = self.random.choice(available)?;
        let process = process.clone();
        self.next_at = Some(now + self.period);
        Some(match kill(pid) {
            Ok(()) => {
                let message = format!("killing {process}, process {pid}, on purpose");
                let times = FaultTimes {
                    injected: Some(now),
                    ..FaultTimes::default()
                };
                self.kills.push(Kill {
                    process,
                    times,
                    epoch: epoch + 1,
                });
                message
            }
            Err(error) => format!("killing {process} failed: {error}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use messages::Health;
    use supervise::Death;

    use super::*;

    const MS: u64 = 1_000_000;

    /// Handles an event at the given time, and returns the id of the process that was killed.
    fn handle_at(random_kills: &mut RandomKills, event: &Event<'_>, ms: u64) -> Option<u32> {
        let mut killed = None;
        random_kills.handle(event, ms * MS, |pid| {
            killed = Some(pid);
            Ok(())
        });
        killed
    }

    fn started(process: &str, pid: u32, epoch: u32) -> Event<'_> {
        Event::Started {
            process,
            pid,
            epoch,
        }
    }

    fn health_at(
        random_kills: &mut RandomKills,
        process: &str,
        epoch: u32,
        frame: u64,
        ms: u64,
    ) -> Option<u32> {
        let health = Health {
            epoch,
            n_sent: 1,
            last_frame: frame,
            ..Health::default()
        };
        let event = Event::Health {
            process,
            health: &health,
        };
        handle_at(random_kills, &event, ms)
    }

    /// Returns the state with two running processes and a result at 100 ms.
    fn after_first_result() -> RandomKills {
        let mut random_kills = RandomKills::new(1, 2000 * MS, 90);
        handle_at(&mut random_kills, &started("triangulate", 70, 0), 0);
        handle_at(&mut random_kills, &started("pose-0", 71, 0), 0);
        assert_eq!(health_at(&mut random_kills, "triangulate", 0, 1, 100), None);
        random_kills
    }

    #[test]
    fn a_process_is_killed_every_period_unless_it_is_restarting() {
        let mut random_kills = after_first_result();
        assert_eq!(health_at(&mut random_kills, "pose-0", 0, 1, 2099), None);
        let first = health_at(&mut random_kills, "pose-0", 0, 1, 2100).unwrap();
        assert_eq!(health_at(&mut random_kills, "pose-0", 0, 1, 2200), None);
        // The other process is killed, because the first process has not been restarted yet.
        let second = handle_at(
            &mut random_kills,
            &Event::Line {
                process: "x",
                text: "",
            },
            4100,
        )
        .unwrap();
        assert_eq!(first + second, 141);
        assert_eq!(
            health_at(&mut random_kills, "pose-0", 0, 1, 6100),
            None,
            "no process is left"
        );
    }

    #[test]
    fn the_times_of_a_killed_process_are_recorded() {
        let mut random_kills = after_first_result();
        handle_at(
            &mut random_kills,
            &Event::Finished {
                process: "triangulate",
            },
            150,
        );
        assert_eq!(health_at(&mut random_kills, "pose-0", 0, 1, 2100), Some(71));
        // This health message is from before the kill.
        health_at(&mut random_kills, "pose-0", 0, 1, 2101);
        let died = Event::Died {
            process: "pose-0",
            death: Death::Signal { number: 9 },
        };
        handle_at(&mut random_kills, &died, 2103);
        handle_at(&mut random_kills, &started("pose-0", 75, 1), 2203);
        let away = |kill: &Kill, results: &[FrameResult]| {
            kill.downtime_ms(EpochSource::Result, 1000 * MS, results)
        };
        assert_eq!(away(&random_kills.kills()[0], &[]), None);
        health_at(&mut random_kills, "pose-0", 1, 1, 2900);
        let expected = FaultTimes {
            injected: Some(2100 * MS),
            noticed: Some(2103 * MS),
            restarted: Some(2203 * MS),
            recovered: Some(2900 * MS),
        };
        let [kill] = random_kills.kills() else {
            panic!("{:?}", random_kills.kills())
        };
        assert_eq!((kill.process.as_str(), kill.times), ("pose-0", expected));
        assert_eq!(away(kill, &[]), Some(800.0));
        let of_life = |epoch, sent_ms| FrameResult {
            frame: 1,
            epoch,
            sent_ms,
            people: Vec::new(),
            views: Vec::new(),
        };
        let results = [of_life(0, 1000.0), of_life(1, 1750.0), of_life(1, 1900.0)];
        assert_eq!(
            away(kill, &results),
            Some(650.0),
            "the results take precedence"
        );
    }

    #[test]
    fn no_process_is_killed_after_the_last_frame() {
        let mut random_kills = after_first_result();
        assert_eq!(
            health_at(&mut random_kills, "triangulate", 0, 90, 2100),
            None
        );
        assert_eq!(
            health_at(&mut random_kills, "triangulate", 1, 2, 9999),
            None
        );
    }
}
