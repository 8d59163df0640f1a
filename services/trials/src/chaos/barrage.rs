//! Blow after blow: processes chosen at random are killed, and what is heard of every one of them afterwards.

use std::collections::BTreeMap;
use std::io;

use fastrand::Rng;
use supervise::Event;

use crate::trial::cost::Trace;
use crate::trial::results::Moment;
use crate::trial::strike::{Times, is_at_work};

/// Processes that are killed one after the other.
#[derive(Debug)]
pub(super) struct Barrage {
    random: Rng,
    /// Between two kills, nanoseconds.
    period: u64,
    /// Nobody is killed once there is a result of this frame.
    until_frame: u64,
    /// When the next one is killed; none before the first result, and after the last kill.
    next_at: Option<u64>,
    is_over: bool,
    /// The processes that run, and how often each had been restarted.
    running: BTreeMap<String, (u32, u32)>,
    kills: Vec<Kill>,
}

/// One kill.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Kill {
    /// Who.
    pub process: String,
    /// What was heard of it.
    pub times: Times,
    /// How often it had been restarted when it began its next life.
    pub life: u32,
}

impl Kill {
    /// How long it was away, milliseconds: until it sent the first of what a result owes to, and of processes that
    /// no result names until its first sign of having worked.
    ///
    /// * `session`: when the run was planned, `runtime::now_nanos`.
    pub(super) fn away_ms(&self, trace: Trace, session: u64, moments: &[Moment]) -> Option<f64> {
        let killed = self.times.killed?;
        let ms = |from: u64, to: u64| to.saturating_sub(from) as f64 / 1e6;
        let sent = trace.began_ms(self.life, moments);
        let sent = sent.map(|it| it - ms(session, killed));
        sent.or_else(|| Some(ms(killed, self.times.heard?)))
    }
}

impl Barrage {
    /// * `period`: between two kills, nanoseconds.
    /// * `until_frame`: nobody is killed once there is a result of this frame, so that all can come back.
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

    /// All that was done.
    pub(super) fn kills(&self) -> &[Kill] {
        &self.kills
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
        match *event {
            Event::Started {
                process,
                pid,
                epoch,
            } => {
                self.running.insert(process.to_owned(), (pid, epoch));
                if let Some(open) = self.open(process) {
                    open.times.started.get_or_insert(now);
                }
            }
            Event::Died { process, .. } | Event::Finished { process } => {
                self.running.remove(process);
                if let Some(open) = self.open(process) {
                    open.times.noticed.get_or_insert(now);
                }
            }
            Event::Health { process, health } => {
                if process == "triangulate" && health.n_sent > 0 {
                    self.next_at.get_or_insert(now + self.period);
                    self.is_over |= health.last_frame >= self.until_frame;
                }
                if let Some(open) = self.open(process)
                    && is_at_work(process, health, open.life)
                {
                    open.times.heard = Some(now);
                }
            }
            Event::Stopping => self.is_over = true,
            _ => {}
        }
        self.strike(now, kill)
    }

    /// The kill of a process that has not been heard of since.
    fn open(&mut self, process: &str) -> Option<&mut Kill> {
        let mut kills = self.kills.iter_mut();
        kills.find(|it| it.process == process && it.times.heard.is_none())
    }

    fn strike(&mut self, now: u64, kill: impl FnOnce(u32) -> io::Result<()>) -> Option<String> {
        self.next_at.filter(|at| *at <= now && !self.is_over)?;
        let is_away = |name: &str| {
            let mut kills = self.kills.iter();
            kills.any(|it| it.process == name && it.times.heard.is_none())
        };
        let there: Vec<_> = self.running.iter().filter(|it| !is_away(it.0)).collect();
        let (process, &(pid, epoch)) = self.random.choice(there)?;
        let process = process.clone();
        self.next_at = Some(now + self.period);
        Some(match kill(pid) {
            Ok(()) => {
                let said = format!("killing {process}, process {pid}, on purpose");
                let times = Times {
                    killed: Some(now),
                    ..Times::default()
                };
                self.kills.push(Kill {
                    process,
                    times,
                    life: epoch + 1,
                });
                said
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

    /// Tells a barrage something at a time; who was killed.
    fn tell(barrage: &mut Barrage, event: &Event<'_>, ms: u64) -> Option<u32> {
        let mut killed = None;
        barrage.note(event, ms * MS, |pid| {
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

    fn say(barrage: &mut Barrage, process: &str, epoch: u32, frame: u64, ms: u64) -> Option<u32> {
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
        tell(barrage, &event, ms)
    }

    /// Two processes run, and there is a result at 100 ms.
    fn begun() -> Barrage {
        let mut barrage = Barrage::new(1, 2000 * MS, 90);
        tell(&mut barrage, &started("triangulate", 70, 0), 0);
        tell(&mut barrage, &started("pose-0", 71, 0), 0);
        assert_eq!(say(&mut barrage, "triangulate", 0, 1, 100), None);
        barrage
    }

    #[test]
    fn one_is_killed_every_period_and_who_is_away_is_spared() {
        let mut barrage = begun();
        assert_eq!(say(&mut barrage, "pose-0", 0, 1, 2099), None);
        let first = say(&mut barrage, "pose-0", 0, 1, 2100).unwrap();
        assert_eq!(say(&mut barrage, "pose-0", 0, 1, 2200), None);
        // The other one, for the first is not back.
        let second = tell(
            &mut barrage,
            &Event::Line {
                process: "x",
                text: "",
            },
            4100,
        )
        .unwrap();
        assert_eq!(first + second, 141);
        assert_eq!(
            say(&mut barrage, "pose-0", 0, 1, 6100),
            None,
            "nobody is left"
        );
    }

    #[test]
    fn what_is_heard_of_a_killed_process_is_kept() {
        let mut barrage = begun();
        tell(
            &mut barrage,
            &Event::Finished {
                process: "triangulate",
            },
            150,
        );
        assert_eq!(say(&mut barrage, "pose-0", 0, 1, 2100), Some(71));
        // A sign that it gave before.
        say(&mut barrage, "pose-0", 0, 1, 2101);
        let died = Event::Died {
            process: "pose-0",
            death: Death::Signal { number: 9 },
        };
        tell(&mut barrage, &died, 2103);
        tell(&mut barrage, &started("pose-0", 75, 1), 2203);
        let away =
            |kill: &Kill, moments: &[Moment]| kill.away_ms(Trace::Result, 1000 * MS, moments);
        assert_eq!(away(&barrage.kills()[0], &[]), None);
        say(&mut barrage, "pose-0", 1, 1, 2900);
        let expected = Times {
            killed: Some(2100 * MS),
            noticed: Some(2103 * MS),
            started: Some(2203 * MS),
            heard: Some(2900 * MS),
        };
        let [kill] = barrage.kills() else {
            panic!("{:?}", barrage.kills())
        };
        assert_eq!((kill.process.as_str(), kill.times), ("pose-0", expected));
        assert_eq!(away(kill, &[]), Some(800.0));
        let of_life = |epoch, sent_ms| Moment {
            frame: 1,
            epoch,
            sent_ms,
            joints: Vec::new(),
            views: Vec::new(),
        };
        let moments = [of_life(0, 1000.0), of_life(1, 1750.0), of_life(1, 1900.0)];
        assert_eq!(away(kill, &moments), Some(650.0), "what it sent says more");
    }

    #[test]
    fn towards_the_end_nobody_is_killed_any_more() {
        let mut barrage = begun();
        assert_eq!(say(&mut barrage, "triangulate", 0, 90, 2100), None);
        assert_eq!(say(&mut barrage, "triangulate", 1, 2, 9999), None);
    }
}
