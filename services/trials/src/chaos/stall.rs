//! A recorder that stops reading for some seconds and then goes on: what the others do meanwhile.

use std::io;

use report::run::Limit;
use runtime::Failure;
use serde::Serialize;
use serde_json::json;
use supervise::Event;

use super::aim::{STRIKE_AFTER, frame_at};
use super::ground::Ground;
use super::judge::Aftermath;
use super::options::{Limits, Options};
use super::scenario::STALL;
use super::verdict::{Verdict, ms};
use crate::trial::limit::{at_least, at_most};

/// How long it stands still, nanoseconds.
const STALL_NANOS: u64 = 3_000_000_000;
/// Nobody takes it for hung.
const PATIENT: [&str; 2] = ["supervise.missed_beats=1000", "supervise.hang_limit_s=600"];
/// Where the latest frame wins, results go on at no less than this share of the rate before.
const SHARE: f64 = 0.5;

/// A recorder that is to stand still, or has.
#[derive(Debug, Default)]
pub(super) struct Stall {
    /// Once there is a result of this frame.
    at_frame: u64,
    pid: Option<u32>,
    /// When the first result was told, and how many there were.
    first: Option<[u64; 2]>,
    /// When it was stopped and when it was let go, and how many results there were.
    stopped: Option<[u64; 2]>,
    freed: Option<[u64; 2]>,
}

/// What was measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Stalled {
    /// For how long, milliseconds.
    pub stall_ms: f64,
    /// Results a second that were made before and meanwhile.
    pub rates_hz: [f64; 2],
}

impl Stall {
    pub(super) fn new(at_frame: u64) -> Self {
        Self {
            at_frame,
            ..Self::default()
        }
    }

    /// Takes note of what the supervisor tells, stops the recorder and lets it go when it is time, and says so.
    ///
    /// * `now`: `runtime::now_nanos`.
    /// * `signal`: stops (true) the process of a number, or lets it go on.
    pub(super) fn note(
        &mut self,
        event: &Event<'_>,
        now: u64,
        signal: impl FnOnce(bool, u32) -> io::Result<()>,
    ) -> Option<String> {
        match *event {
            Event::Started {
                process: "results",
                pid,
                ..
            } => self.pid = Some(pid),
            Event::Died {
                process: "results", ..
            }
            | Event::Finished { process: "results" } => self.pid = None,
            Event::Health {
                process: "triangulate",
                health,
            } if health.n_sent > 0 => {
                return self.turn([now, health.n_sent], health.last_frame, signal);
            }
            _ => {}
        }
        None
    }

    fn turn(
        &mut self,
        state: [u64; 2],
        frame: u64,
        signal: impl FnOnce(bool, u32) -> io::Result<()>,
    ) -> Option<String> {
        self.first.get_or_insert(state);
        let pid = self.pid?;
        let (stops, said) = match (self.stopped, self.freed) {
            (None, _) if frame >= self.at_frame => (true, "stopping results on purpose"),
            (Some([at, _]), None) if state[0] - at >= STALL_NANOS => {
                (false, "letting results go on")
            }
            _ => return None,
        };
        let done = if stops {
            &mut self.stopped
        } else {
            &mut self.freed
        };
        *done = Some(state);
        Some(match signal(stops, pid) {
            Ok(()) => format!("{said}, process {pid}"),
            Err(error) => format!("{said} failed: {error}"),
        })
    }

    /// What was measured, if it stood still and went on.
    pub(super) fn stalled(&self) -> Option<Stalled> {
        let [first, stopped, freed] = [self.first?, self.stopped?, self.freed?];
        let rate = |from: [u64; 2], to: [u64; 2]| {
            (to[1] - from[1].min(to[1])) as f64 * 1e9 / (to[0] - from[0]).max(1) as f64
        };
        Some(Stalled {
            stall_ms: (freed[0] - stopped[0]) as f64 / 1e6,
            rates_hz: [rate(first, stopped), rate(stopped, freed)],
        })
    }
}

/// What must hold: in realtime the others go on; where nothing may be lost, nothing is.
fn judge(
    asked: &Limits,
    it: Option<&Stalled>,
    every_frame: Option<u64>,
    after: &Aftermath,
) -> Vec<Limit> {
    let most_ms = STALL_NANOS as f64 / 1e6 + asked.max_pause_ms;
    let mut limits = vec![at_most(
        "it stood still, ms",
        most_ms,
        it.map(|it| it.stall_ms),
    )];
    limits.push(if let Some(n) = every_frame {
        at_least("results written", n as f64, Some(after.n_results as f64))
    } else {
        let [before, meanwhile] = it.map_or([f64::NAN; 2], |it| it.rates_hz);
        let meanwhile = Some(meanwhile).filter(|it| it.is_finite());
        at_least("results a second meanwhile", SHARE * before, meanwhile)
    });
    limits.extend(after.judge(0));
    limits
}

/// Stops the recorder for some seconds.
pub(super) fn attempt(ground: &Ground, options: &Options) -> Result<Verdict, Failure> {
    let planned = ground.plan(STALL, &PATIENT)?;
    let mut stall = Stall::new(frame_at(&planned, STRIKE_AFTER) as u64);
    let ran = ground.watch(&planned, &mut |event| {
        stall.note(event, runtime::now_nanos(), |stops, pid| {
            if stops {
                runtime::freeze(pid)
            } else {
                runtime::thaw(pid)
            }
        })
    });
    let after = ran.aftermath(|_| 0);
    let it = stall.stalled();
    let is_lossless = planned.resolved().delivery() == runtime::Delivery::Lossless;
    let every_frame = is_lossless.then(|| planned.resolved().n_frames());
    let [before, meanwhile] = it.map_or([0.0; 2], |it| it.rates_hz);
    Ok(Verdict {
        scenario: STALL.to_owned(),
        measured: format!(
            "results stood still for {}; results a second {before:.1} before, {meanwhile:.1} meanwhile; {} results written",
            ms(it.map(|it| it.stall_ms)),
            after.n_results
        ),
        more: Vec::new(),
        numbers: json!(it),
        limits: judge(&options.limits, it.as_ref(), every_frame, &after),
        run: ran.json(),
    })
}

#[cfg(test)]
mod tests {
    use messages::Health;

    use super::*;

    const SECOND: u64 = 1_000_000_000;

    /// Tells of so many results at a time; what is done to the recorder.
    fn tell(stall: &mut Stall, n_sent: u64, at: u64) -> Option<bool> {
        let health = Health {
            n_sent,
            last_frame: n_sent,
            ..Health::default()
        };
        let event = Event::Health {
            process: "triangulate",
            health: &health,
        };
        let mut done = None;
        stall.note(&event, at, |stops, pid| {
            assert_eq!(pid, 7);
            done = Some(stops);
            Ok(())
        });
        done
    }

    #[test]
    fn it_is_stopped_once_and_let_go_once_and_rates_are_told_apart() {
        let mut stall = Stall::new(10);
        let started = Event::Started {
            process: "results",
            pid: 7,
            epoch: 0,
        };
        assert_eq!(stall.note(&started, 0, |_, _| Ok(())), None);
        let told = [(2, 1), (10, 3), (12, 4), (16, 6), (17, 7)];
        let done = told.map(|(n, at)| tell(&mut stall, n, at * SECOND));
        assert_eq!(done, [None, Some(true), None, Some(false), None]);
        let expected = Stalled {
            stall_ms: 3000.0,
            rates_hz: [4.0, 2.0],
        };
        assert_eq!(stall.stalled(), Some(expected));
    }

    #[test]
    fn who_is_held_up_has_missed_and_who_loses_nothing_may_be() {
        let asked = Limits {
            max_return_ms: 1000.0,
            max_pause_ms: 1000.0,
        };
        let after = Aftermath {
            n_results: 20,
            ..Aftermath::default()
        };
        let missed = |it: Option<Stalled>, every_frame| {
            let limits = judge(&asked, it.as_ref(), every_frame, &after).into_iter();
            limits
                .filter(|it| !it.held)
                .map(|it| it.what)
                .collect::<Vec<_>>()
        };
        let with = |rate| {
            Some(Stalled {
                stall_ms: 3010.0,
                rates_hz: [4.0, rate],
            })
        };
        assert_eq!(missed(with(2.0), None), [""; 0]);
        assert_eq!(missed(with(1.9), None), ["results a second meanwhile"]);
        assert_eq!(missed(with(0.0), Some(20)), [""; 0]);
        assert_eq!(missed(with(0.0), Some(21)), ["results written"]);
        assert_eq!(missed(None, None).len(), 2);
    }
}
