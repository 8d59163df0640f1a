//! Measures one hop (the transfer of a message from one process to another), with a receiver that either is woken by an event or polls.

use std::time::Duration;

use exports::report::run::Limit;
use failure::wording::Table;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use runtime::{Policy, RealTime, Scheduling};
use serde_json::{Value, json};
use terminal::output::{self, Verbosity};

use super::hop::{self, Measured, Series};
use super::provenance::Provenance;
use super::report::Report;
use crate::spread::Spread;
use crate::trial::limit;

/// Options of the transport benchmark.
#[derive(Debug, Clone)]
pub struct Transport {
    /// Messages per series.
    pub messages: u64,
    /// Interval between messages, in microseconds.
    pub interval_us: u64,
    /// Sizes of messages, in bytes, at least 16. There is one series for each size.
    pub bytes: Vec<usize>,
    /// True to measure the polling receiver only.
    pub spin: bool,
    /// Cores of the sender and the receiver. If empty, both may use any core.
    pub cores: Vec<usize>,
    /// Real-time priority of both processes, 1 to 99.
    pub priority: Option<u8>,
    /// The largest median of a hop with a receiver that is woken by an event, in microseconds.
    pub max_event_us: Option<f64>,
    /// The largest median of a hop with a polling receiver, in microseconds.
    pub max_polled_us: Option<f64>,
    /// The name of the deployment, unique among those that run at the same time.
    pub name: String,
}

/// A row of the table.
struct Row {
    spins: bool,
    bytes: usize,
    measured: Measured,
}

/// Measures all series. `None` if the benchmark was interrupted.
///
/// # Errors
///
/// Fails if the number of cores is not 0 or 2, or if the receiving process cannot be started or does not report.
pub fn transport(options: &Transport, verbosity: Verbosity) -> Result<Option<Report>, Failure> {
    let [sender, receiver] = options.scheduling()?;
    let provenance = Provenance::now();
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    for denied in sender.apply() {
        tracing::warn!(
            "{denied}; continuing without this setting. Try: {}",
            denied.hint()
        );
    }
    let mut rows = Vec::new();
    for spins in [false, true] {
        if options.spin && !spins {
            continue;
        }
        for &bytes in &options.bytes {
            let series = Series {
                name: options.name.clone(),
                bytes,
                n_messages: options.messages,
                interval: Duration::from_micros(options.interval_us),
                receiver: Scheduling {
                    spin: spins,
                    ..receiver.clone()
                },
                log: verbosity.level,
            };
            if !verbosity.quiet {
                let (mode, n) = (mode(spins), options.messages);
                output::message(format_args!("{n} messages of {bytes} bytes, {mode} ..."));
            }
            let Some(measured) = hop::measure(&series, &stop)? else {
                return Ok(None);
            };
            rows.push(Row {
                spins,
                bytes,
                measured,
            });
        }
    }
    Ok(Some(options.report(provenance, &rows)))
}

fn mode(spins: bool) -> &'static str {
    if spins {
        "polling"
    } else {
        "woken by an event"
    }
}

impl Transport {
    /// Returns the scheduling of the sender and the receiver.
    fn scheduling(&self) -> Result<[Scheduling; 2], Failure> {
        if ![0, 2].contains(&self.cores.len()) {
            let message =
                "--cores needs two values: the core of the sender and that of the receiver";
            return Err(Failure::new(ExitKind::Usage, message));
        }
        let of = |index: usize| Scheduling {
            cores: self.cores.get(index).copied().into_iter().collect(),
            real_time: self.priority.map(|priority| RealTime {
                policy: Policy::Fifo,
                priority,
            }),
            ..Scheduling::default()
        };
        Ok([of(0), of(1)])
    }

    fn report(&self, provenance: Provenance, rows: &[Row]) -> Report {
        let heads = ["<receiver", "bytes", "p50", "p99", "p99.9", "max", "lost"];
        let mut table = Table::new(heads);
        for row in rows {
            table.row(row.cells());
        }
        let [sender, receiver] = [0, 1].map(|index| {
            let core = self.cores.get(index).map(ToString::to_string);
            core.unwrap_or_else(|| "any".to_owned())
        });
        Report {
            bench: "transport",
            title: "one hop between two processes, microseconds".to_owned(),
            provenance,
            settings: json!({
                "messages": self.messages,
                "interval_us": self.interval_us,
                "sender_core": sender,
                "receiver_core": receiver,
                "real_time_priority": self.priority.map_or_else(|| "none".to_owned(), |priority| priority.to_string()),
            }),
            table,
            notes: Vec::new(),
            limits: self.limits(rows),
            numbers: rows.iter().map(Row::json).collect(),
        }
    }

    /// Returns the requested limits, and the limits that always apply.
    fn limits(&self, rows: &[Row]) -> Vec<Limit> {
        let mut limits = Vec::new();
        for (spins, most) in [(false, self.max_event_us), (true, self.max_polled_us)] {
            let Some(most) = most else { continue };
            for row in rows.iter().filter(|row| row.spins == spins) {
                let what = format!("p50 of {} bytes {}, us", row.bytes, mode(spins));
                let got = row.measured.receiver.hop_us.map(|hop_u| hop_u.p50);
                limits.push(limit::at_most(&what, most, got));
            }
        }
        let sum = |of: fn(&Measured) -> u64| rows.iter().map(|row| of(&row.measured)).sum::<u64>();
        let compared = sum(|measured| measured.n_compared as u64);
        limits.extend([
            limit::at_least("messages with a known location", 1.0, Some(compared as f64)),
            limit::at_most(
                "messages received at another location",
                0.0,
                Some((compared - sum(|measured| measured.n_same_place as u64)) as f64),
            ),
            limit::at_most(
                "bytes copied",
                0.0,
                Some(sum(|measured| measured.copied_bytes) as f64),
            ),
            limit::at_most(
                "messages with wrong content",
                0.0,
                Some(sum(|measured| measured.receiver.broken) as f64),
            ),
        ]);
        limits
    }
}

impl Row {
    fn lost(&self) -> u64 {
        self.measured.sent.saturating_sub(self.measured.receiver.received)
    }

    fn cells(&self) -> Vec<String> {
        let mut cells = vec![mode(self.spins).to_owned(), self.bytes.to_string()];
        cells.extend(Spread::cells(self.measured.receiver.hop_us, 2));
        cells.push(self.lost().to_string());
        cells
    }

    fn json(&self) -> Value {
        let measured = &self.measured;
        json!({
            "receiver": if self.spins { "poll" } else { "event" },
            "bytes": self.bytes,
            "sent": measured.sent,
            "received": measured.receiver.received,
            "lost": self.lost(),
            "broken": measured.receiver.broken,
            "hop_us": measured.receiver.hop_us,
            "places": { "compared": measured.n_compared, "same": measured.n_same_place },
            "copied_bytes": measured.copied_bytes,
        })
    }
}
