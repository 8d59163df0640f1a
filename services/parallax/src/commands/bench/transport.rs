//! `parallax bench transport`: one hop between two processes, woken by an event and polling.

use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use launch::output;
use report::run::Limit;
use runtime::{ExitKind, Failure, OrFail as _, Policy, RealTime, Scheduling, Stop};
use serde_json::{Value, json};

use super::hop::{self, Measured, Series};
use super::occasion::Occasion;
use super::report::Report;
use super::{EXITS, Output};
use crate::globals::Globals;
use crate::spread::Spread;
use crate::trial::limit;

const HELP: &str = "\
One process writes messages into shared memory at a steady pace, another receives them. A hop is the time from just \
before sending to just after receiving, by the one clock of the machine; that the receiver slept is part of it, and \
writing the message is not. Measured are a small message and a frame of pixels, each with a receiver that sleeps until \
an event wakes it (the default of a deployment) and with one that polls (`runtime.spin`), which takes a core for \
itself.

It also proves that nothing is copied: both processes say at which place of which file of /dev/shm the first messages \
lie, which must be the same for both, and count the bytes that their ports copied, which must be none.

On a machine with one core, or whose cores others use, the numbers say more of those than of the transport: --cores \
and --priority keep others off, and the load average stands in the report.";

/// What to measure.
#[derive(Debug, Args)]
#[command(after_help = EXITS, after_long_help = format!("{HELP}\n\n{EXITS}"))]
pub(crate) struct Arguments {
    /// Messages of every series.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    messages: u64,
    /// From one message to the next, microseconds.
    #[arg(long, value_name = "US", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(50..=1_000_000))]
    interval_us: u64,
    /// Bytes of the small message and of the frame.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "64,921600", value_parser = bytes)]
    bytes: Vec<usize>,
    /// Only the receiver that polls.
    #[arg(long)]
    spin: bool,
    /// Cores for the sender and the receiver.
    #[arg(long, value_name = "A,B", value_delimiter = ',', num_args = 1)]
    cores: Vec<usize>,
    /// Real-time priority of both, 1 to 99.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=99))]
    priority: Option<u8>,
    /// Largest median of a hop when woken, microseconds.
    #[arg(long, value_name = "US")]
    max_event_us: Option<f64>,
    /// Largest median of a hop when polling, microseconds.
    #[arg(long, value_name = "US")]
    max_polled_us: Option<f64>,
    /// Name of the deployment: two that run at once need two.
    #[arg(long, value_name = "NAME", default_value = "bench-transport")]
    name: String,
    /// Where numbers go.
    #[command(flatten)]
    output: Output,
}

/// Bytes of a message, for the command line.
fn bytes(text: &str) -> Result<usize, String> {
    let n = text.parse().ok().filter(|it| (16..=1 << 30).contains(it));
    n.ok_or_else(|| "expected 16 to 1073741824 bytes".to_owned())
}

/// One row of the table.
struct Row {
    spins: bool,
    bytes: usize,
    measured: Measured,
}

/// Measures all series.
pub(super) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let [sender, receiver] = arguments.scheduling()?;
    let occasion = Occasion::now();
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    for denied in sender.apply() {
        tracing::warn!("{denied}; going on without. Try: {}", denied.hint());
    }
    let mut rows = Vec::new();
    for spins in [false, true] {
        if arguments.spin && !spins {
            continue;
        }
        for &bytes in &arguments.bytes {
            let series = Series {
                name: arguments.name.clone(),
                bytes,
                n_messages: arguments.messages,
                interval: Duration::from_micros(arguments.interval_us),
                receiver: Scheduling {
                    spin: spins,
                    ..receiver.clone()
                },
                log: globals.level(),
            };
            if !globals.quiet {
                let (how, n) = (how(spins), arguments.messages);
                output::message(format_args!("{n} messages of {bytes} bytes, {how} ..."));
            }
            let Some(measured) = hop::measure(&series, &stop)? else {
                output::message("stopped: nothing is reported");
                return Ok(ExitCode::from(ExitKind::Interrupted.status()));
            };
            rows.push(Row {
                spins,
                bytes,
                measured,
            });
        }
    }
    arguments
        .report(occasion, &rows)
        .publish(&arguments.output, globals)
}

fn how(spins: bool) -> &'static str {
    if spins {
        "polling"
    } else {
        "woken by an event"
    }
}

impl Arguments {
    /// Of the sender and the receiver.
    fn scheduling(&self) -> Result<[Scheduling; 2], Failure> {
        if ![0, 2].contains(&self.cores.len()) {
            let message = "--cores takes two: the sender's and the receiver's";
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

    fn report(&self, occasion: Occasion, rows: &[Row]) -> Report {
        let heads = ["receiver", "bytes", "p50", "p99", "p99.9", "max", "lost"];
        let table = [heads.map(str::to_owned).to_vec()].into_iter();
        let [sender, receiver] = [0, 1].map(|it| {
            let core = self.cores.get(it).map(ToString::to_string);
            core.unwrap_or_else(|| "any".to_owned())
        });
        Report {
            bench: "transport",
            title: "one hop between two processes, microseconds".to_owned(),
            occasion,
            settings: json!({
                "messages": self.messages,
                "interval_us": self.interval_us,
                "sender_core": sender,
                "receiver_core": receiver,
                "real_time_priority": self.priority.map_or_else(|| "none".to_owned(), |it| it.to_string()),
            }),
            table: table.chain(rows.iter().map(Row::cells)).collect(),
            notes: Vec::new(),
            limits: self.limits(rows),
            numbers: rows.iter().map(Row::json).collect(),
        }
    }

    /// What was asked for, and what must always hold.
    fn limits(&self, rows: &[Row]) -> Vec<Limit> {
        let mut limits = Vec::new();
        for (spins, most) in [(false, self.max_event_us), (true, self.max_polled_us)] {
            let Some(most) = most else { continue };
            for row in rows.iter().filter(|it| it.spins == spins) {
                let what = format!("p50 of {} bytes {}, us", row.bytes, how(spins));
                let got = row.measured.heard.hop_us.map(|it| it.p50);
                limits.push(limit::at_most(&what, most, got));
            }
        }
        let sum = |of: fn(&Measured) -> u64| rows.iter().map(|it| of(&it.measured)).sum::<u64>();
        let compared = sum(|it| it.n_compared as u64);
        limits.extend([
            limit::at_least("messages asked where they lie", 1.0, Some(compared as f64)),
            limit::at_most(
                "of these elsewhere than they were written",
                0.0,
                Some((compared - sum(|it| it.n_same_place as u64)) as f64),
            ),
            limit::at_most("bytes copied", 0.0, Some(sum(|it| it.copied_bytes) as f64)),
            limit::at_most(
                "messages with another content",
                0.0,
                Some(sum(|it| it.heard.broken) as f64),
            ),
        ]);
        limits
    }
}

impl Row {
    fn lost(&self) -> u64 {
        self.measured
            .sent
            .saturating_sub(self.measured.heard.received)
    }

    fn cells(&self) -> Vec<String> {
        let mut cells = vec![how(self.spins).to_owned(), self.bytes.to_string()];
        cells.extend(Spread::cells(self.measured.heard.hop_us, 2));
        cells.push(self.lost().to_string());
        cells
    }

    fn json(&self) -> Value {
        let it = &self.measured;
        json!({
            "receiver": if self.spins { "poll" } else { "event" },
            "bytes": self.bytes,
            "sent": it.sent,
            "received": it.heard.received,
            "lost": self.lost(),
            "broken": it.heard.broken,
            "hop_us": it.heard.hop_us,
            "places": { "compared": it.n_compared, "same": it.n_same_place },
            "copied_bytes": it.copied_bytes,
        })
    }
}
