//! `parallax bench transport`: measures the transfer of messages from one process to another.

use clap::Args;
use trials::bench::Transport;

use super::{EXITS, Output};

const HELP: &str = "\
One process writes messages into shared memory at a fixed interval, and another process receives them. A hop is the time from just \
before sending to just after receiving, by the clock of the machine. It includes the wake-up of the receiver, but not \
the writing of the message. The benchmark measures a small message and a frame of pixels. Each is measured with a receiver that sleeps until \
an event wakes it (the default of a deployment), and with a receiver that polls (`runtime.spin`), which occupies a \
core.

The benchmark also checks that nothing is copied. Both processes record the file in /dev/shm and the offset of the first messages, \
which must be equal. Both count the bytes that their ports copied, which must be 0.

On a machine with one core, or with other load, the numbers depend more on the scheduler than on the transport. --cores \
and --priority reduce this effect, and the report shows the load average.";

/// Options of the transport benchmark.
#[derive(Debug, Args)]
#[command(after_help = EXITS, after_long_help = format!("{HELP}\n\n{EXITS}"))]
pub(crate) struct Arguments {
    /// Messages per series.
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u64).range(1..=10_000_000))]
    messages: u64,
    /// Interval between messages, in microseconds.
    #[arg(long, value_name = "US", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(50..=1_000_000))]
    interval_us: u64,
    /// Sizes of the small message and of the frame, in bytes.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "64,921600", value_parser = bytes)]
    bytes: Vec<usize>,
    /// Measure only the polling receiver.
    #[arg(long)]
    spin: bool,
    /// Processor cores of the sender and the receiver.
    #[arg(long, value_name = "A,B", value_delimiter = ',', num_args = 1)]
    cores: Vec<usize>,
    /// Real-time priority of both processes, 1 to 99.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=99))]
    priority: Option<u8>,
    /// Limit on the median time of a hop with a receiver that an event wakes, in microseconds.
    #[arg(long, value_name = "US")]
    max_event_us: Option<f64>,
    /// Limit on the median time of a hop with a polling receiver, in microseconds.
    #[arg(long, value_name = "US")]
    max_polled_us: Option<f64>,
    /// Name of the deployment. It must be unique among running deployments.
    #[arg(long, value_name = "NAME", default_value = "bench-transport")]
    name: String,
    /// Output options.
    #[command(flatten)]
    pub(super) output: Output,
}

/// Parses the size of a message, in bytes.
fn bytes(text: &str) -> Result<usize, String> {
    let n = text.parse().ok().filter(|value| (16..=1 << 30).contains(value));
    n.ok_or_else(|| "expected 16 to 1073741824 bytes".to_owned())
}

impl Arguments {
    /// Returns the options of the benchmark.
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
