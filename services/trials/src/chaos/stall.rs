//! The scenario `stall-results`: the process `results` is stopped for some seconds and then resumed.

use std::io;

use exports::report::run::Limit;
use failure::Failure;
use serde::Serialize;
use serde_json::json;
use supervise::Event;

use super::judge::RunOutcome;
use super::options::{Limits, Options};
use super::scenario::STALL;
use super::target::{INJECT_AFTER, frame_at};
use super::testbed::Testbed;
use super::verdict::{Verdict, ms};
use crate::trial::limit::{at_least, at_most};

/// Duration of the stop, in nanoseconds.
const STALL_NANOS: u64 = 3_000_000_000;
/// Settings with which the supervisor does not treat the stopped process as hung.
const NO_HANG_DETECTION: [&str; 2] = ["supervise.missed_beats=1000", "supervise.hang_limit_s=600"];
/// With realtime delivery, the smallest rate of results during the stop, as a fraction of the rate before the stop.
const SHARE: f64 = 0.5;

/// Stops and resumes the process `results`, and measures the rate of results.
#[derive(Debug, Default)]
pub(super) struct StallInjector {
    /// Number of the frame after whose result the process is stopped.
    at_frame: u64,
    pid: Option<u32>,
    /// Time in nanoseconds, and number of results, at the first health message that reports a result.
    first: Option<[u64; 2]>,
    /// Time in nanoseconds, and number of results, when the process was stopped.
    stopped: Option<[u64; 2]>,
    /// Time in nanoseconds, and number of results, when the process was resumed.
    resumed: Option<[u64; 2]>,
}

/// Measurements of the stop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct StallMeasurement {
    /// Duration of the stop, in milliseconds.
    pub stall_ms: f64,
    /// Results per second before and during the stop.
    pub rates_hz: [f64; 2],
}

impl StallInjector {
    pub(super) fn new(at_frame: u64) -> Self {
        Self {
            at_frame,
            ..Self::default()
        }
    }

    /// Handles an event of the supervisor, and stops or resumes the process if it is time. Returns a message about the stop.
    ///
    /// * `now`: current time (`failure::now_nanos`).
    /// * `signal`: stops (true) or resumes (false) the process with this id.
    pub(super) fn handle(
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
                return self.stop_or_resume([now, health.n_sent], health.last_frame, signal);
            }
            _ => {}
        }
        None
    }

    fn stop_or_resume(
        &mut self,
        state: [u64; 2],
        frame: u64,
        signal: impl FnOnce(bool, u32) -> io::Result<()>,
    ) -> Option<String> {
        self.first.get_or_insert(state);
        let pid = self.pid?;
        let (stops, message) = match (self.stopped, self.resumed) {
            (None, _) if frame >= self.at_frame => {
                (true, "stopping the process results on purpose")
            }
            (Some([at, _]), None) if state[0] - at >= STALL_NANOS => {
                (false, "resuming the process results")
            }
            _ => return None,
        };
        let done = if stops {
            &mut self.stopped
        } else {
            &mut self.resumed
        };
        *done = Some(state);
        Some(match signal(stops, pid) {
            Ok(()) => format!("{message}, process {pid}"),
            Err(error) => format!("{message} failed: {error}"),
        })
    }

    /// Returns the measurements; `None` if the process was not stopped and resumed.
    pub(super) fn measurement(&self) -> Option<StallMeasurement> {
        let [first, stopped, resumed] = [self.first?, self.stopped?, self.resumed?];
        let rate = |from: [u64; 2], to: [u64; 2]| {
            (to[1] - from[1].min(to[1])) as f64 * 1e9 / (to[0] - from[0]).max(1) as f64
        };
        Some(StallMeasurement {
            stall_ms: (resumed[0] - stopped[0]) as f64 / 1e6,
            rates_hz: [rate(first, stopped), rate(stopped, resumed)],
        })
    }
}

/// Checks the limits. With realtime delivery, the other processes must continue; with lossless delivery, no result may be lost.
///
/// * `every_frame`: the number of frames, with lossless delivery.
fn judge(
    requested: &Limits,
    measurement: Option<&StallMeasurement>,
    every_frame: Option<u64>,
    outcome: &RunOutcome,
) -> Vec<Limit> {
    let most_ms = STALL_NANOS as f64 / 1e6 + requested.max_pause_ms;
    let mut limits = vec![at_most(
        "duration of the stop, ms",
        most_ms,
        measurement.map(|measurement| measurement.stall_ms),
    )];
    limits.push(if let Some(n) = every_frame {
        at_least("results written", n as f64, Some(outcome.n_results as f64))
    } else {
        let [before, meanwhile] =
            measurement.map_or([f64::NAN; 2], |measurement| measurement.rates_hz);
        let meanwhile = Some(meanwhile).filter(|value| value.is_finite());
        at_least(
            "results per second during the stop",
            SHARE * before,
            meanwhile,
        )
    });
    limits.extend(outcome.judge(0));
    limits
}

/// Runs the deployment, and stops the process `results` for some seconds.
pub(super) fn attempt(testbed: &Testbed, options: &Options) -> Result<Verdict, Failure> {
    let planned = testbed.plan(STALL, &NO_HANG_DETECTION)?;
    let mut stall = StallInjector::new(frame_at(&planned, INJECT_AFTER) as u64);
    let run = testbed.run(&planned, &mut |event| {
        stall.handle(event, failure::now_nanos(), |stops, pid| {
            if stops {
                runtime::freeze(pid)
            } else {
                runtime::thaw(pid)
            }
        })
    });
    let outcome = run.outcome(|_| 0);
    let measurement = stall.measurement();
    let is_lossless = planned.resolved().delivery() == runtime::Delivery::Lossless;
    let every_frame = is_lossless.then(|| planned.resolved().n_frames());
    let [before, meanwhile] = measurement.map_or([0.0; 2], |measurement| measurement.rates_hz);
    Ok(Verdict {
        scenario: STALL.to_owned(),
        measured: format!(
            "results stopped for {}; results per second: {before:.1} before, {meanwhile:.1} during the stop; {} results written",
            ms(measurement.map(|measurement| measurement.stall_ms)),
            outcome.n_results
        ),
        details: Vec::new(),
        numbers: json!(measurement),
        limits: judge(&options.limits, measurement.as_ref(), every_frame, &outcome),
        run: run.json(),
    })
}

#[cfg(test)]
mod tests {
    use messages::Health;

    use super::*;

    const SECOND: u64 = 1_000_000_000;

    /// Handles a health message with a number of results at the given time. Returns true if the process was stopped, false if it was
    /// resumed.
    fn health_at(stall: &mut StallInjector, n_sent: u64, at: u64) -> Option<bool> {
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
        stall.handle(&event, at, |stops, pid| {
            assert_eq!(pid, 7);
            done = Some(stops);
            Ok(())
        });
        done
    }

    #[test]
    fn the_process_is_stopped_and_resumed_once_and_both_rates_are_measured() {
        let mut stall = StallInjector::new(10);
        let started = Event::Started {
            process: "results",
            pid: 7,
            epoch: 0,
        };
        assert_eq!(stall.handle(&started, 0, |_, _| Ok(())), None);
        let events = [(2, 1), (10, 3), (12, 4), (16, 6), (17, 7)];
        let done = events.map(|(n, at)| health_at(&mut stall, n, at * SECOND));
        assert_eq!(done, [None, Some(true), None, Some(false), None]);
        let expected = StallMeasurement {
            stall_ms: 3000.0,
            rates_hz: [4.0, 2.0],
        };
        assert_eq!(stall.measurement(), Some(expected));
    }

    #[test]
    fn with_lossless_delivery_only_the_number_of_results_counts() {
        let asked = Limits {
            max_return_ms: 1000.0,
            max_pause_ms: 1000.0,
        };
        let outcome = RunOutcome {
            n_results: 20,
            ..RunOutcome::default()
        };
        let missed = |measurement: Option<StallMeasurement>, every_frame| {
            let limits = judge(&asked, measurement.as_ref(), every_frame, &outcome).into_iter();
            limits.filter(|limit| !limit.held).map(|limit| limit.what).collect::<Vec<_>>()
        };
        let with = |rate| {
            Some(StallMeasurement {
                stall_ms: 3010.0,
                rates_hz: [4.0, rate],
            })
        };
        assert_eq!(missed(with(2.0), None), [""; 0]);
        assert_eq!(
            missed(with(1.9), None),
            ["results per second during the stop"]
        );
        assert_eq!(missed(with(0.0), Some(20)), [""; 0]);
        assert_eq!(missed(with(0.0), Some(21)), ["results written"]);
        assert_eq!(missed(None, None).len(), 2);
    }
}
