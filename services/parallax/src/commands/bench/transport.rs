//! `parallax bench transport`: one hop between two processes, woken by an event and polling.

use clap::Args;
use trials::bench::Transport;

use super::{EXITS, Output};

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
    pub(super) output: Output,
}

/// Bytes of a message, for the command line.
fn bytes(text: &str) -> Result<usize, String> {
    let n = text.parse().ok().filter(|it| (16..=1 << 30).contains(it));
    n.ok_or_else(|| "expected 16 to 1073741824 bytes".to_owned())
}

impl Arguments {
    /// What is to be measured.
    pub(super) fn options(&self) -> Transport {
        Transport {
            messages: self.messages,
            interval_us: self.interval_us,
            bytes: self.bytes.clone(),
            spin: self.spin,
            cores: self.cores.clone(),
            priority: self.priority,
            max_event_us: self.max_event_us,
            max_polled_us: self.max_polled_us,
            name: self.name.clone(),
        }
    }
}
