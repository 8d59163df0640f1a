//! Sends a series of messages from this process to a receiving process.

use std::thread::sleep;
use std::time::{Duration, Instant};

use failure::{ExitKind, Failure, OrFail as _, Stop, now_nanos};
use messages::{FrameHeader, Stamp, Status, Timing, topic};
use runtime::{
    Bus, Child, Delivery, Launch, Limits, Namespace, Scheduling, SlicePublisher, TopicPlan,
    preflight, process_topics,
};
use terminal::output;
use tracing::Level;

use super::receiver::{N_PLACED, ReceiverReport, Spot, WARM_UP, write};

/// Name of the receiving process.
const RECEIVER: &str = "receiver";
/// Longest time to wait for the receiver to start, and for its report.
const PATIENCE: Duration = Duration::from_secs(30);
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Settings of a series.
#[derive(Debug, Clone)]
pub(super) struct Series {
    /// Name of the deployment.
    pub name: String,
    /// Size of a message, in bytes; at least 16.
    pub bytes: usize,
    /// Number of measured messages.
    pub n_messages: u64,
    /// Interval between messages.
    pub interval: Duration,
    /// Scheduling of the receiver, including whether it polls.
    pub receiver: Scheduling,
    /// The log level of the receiver.
    pub log: Level,
}

/// Measurements of a series.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measured {
    /// Number of measured messages that were sent.
    pub sent: u64,
    /// The report of the receiver.
    pub receiver: ReceiverReport,
    /// Number of messages whose location is known in both processes.
    pub n_compared: usize,
    /// Number of compared messages whose location is the same in both processes.
    pub n_same_place: usize,
    /// Bytes copied by the ports of both processes.
    pub copied_bytes: u64,
}

/// Sends a series. Returns `None` if the benchmark was interrupted.
pub(super) fn measure(series: &Series, stop: &Stop) -> Result<Option<Measured>, Failure> {
    let namespace = Namespace::new(&series.name)?;
    let limits = Limits::new(1, 1, 1);
    let pixels = TopicPlan::slices::<u8, FrameHeader>(
        topic::frame(0),
        Delivery::Realtime,
        limits,
        series.bytes,
    );
    let [health, metrics] = process_topics(RECEIVER);
    let topics = [pixels, health, metrics];
    // These values are dropped in reverse order: ports, topics, bus, and finally the lock, which removes all files.
    let lock = namespace.acquire()?;
    preflight(&topics)?;
    let bus = Bus::open(lock.namespace(), "sender", stop)?;
    let _topics = bus.create_topics(&topics)?;
    let publisher = bus.slice_publisher::<u8, FrameHeader>(&topic::frame(0))?;
    let mut child = start(series, lock.namespace())?;
    if publisher.wait_for_subscribers(1, PATIENCE) == 0 && !stop.is_requested() {
        return Err(no_report(&mut child));
    }
    let Some(spots) = send(series, &publisher, stop)? else {
        return Ok(None);
    };
    let Some(receiver) = request_report(&mut child, &publisher, stop)? else {
        return Ok(None);
    };
    let (n_compared, n_same_place) = compare(&spots, &receiver.spots);
    let copied_bytes = bus.copies().bytes() + receiver.copied_bytes;
    Ok(Some(Measured {
        sent: series.n_messages,
        receiver,
        n_compared,
        n_same_place,
        copied_bytes,
    }))
}

fn start(series: &Series, namespace: &Namespace) -> Result<Child, Failure> {
    let launch = Launch {
        namespace: namespace.clone(),
        process: RECEIVER.to_owned(),
        session: now_nanos(),
        epoch: 0,
        delivery: Delivery::Realtime,
        supervisor: Some(std::process::id()),
        log: series.log,
        scheduling: series.receiver.clone(),
    };
    let mut args = vec!["bench".into(), "receive".into()];
    args.extend(launch.to_args());
    let executable = std::env::current_exe().or_fail(ExitKind::Run)?;
    Child::start(&executable, &args).or_fail(ExitKind::Run)
}

/// Sends all messages. Returns the locations of the first messages, or `None` if the benchmark was interrupted.
fn send(
    series: &Series,
    publisher: &SlicePublisher<u8, FrameHeader>,
    stop: &Stop,
) -> Result<Option<Vec<Spot>>, Failure> {
    let mut spots = Vec::new();
    let begin = Instant::now();
    for message in 0..WARM_UP + series.n_messages {
        let due = series.interval.mul_f64(message as f64);
        sleep(due.saturating_sub(begin.elapsed()));
        if stop.is_requested() {
            return Ok(None);
        }
        let mut loan = publisher.loan(series.bytes)?;
        write(message, loan.payload_mut());
        if message < N_PLACED {
            spots.extend(Spot::of(message, loan.payload_mut()));
        }
        *loan.header_mut() = header(message, Status::OK);
        loan.header_mut().timing.sent_at_nanos = now_nanos();
        loan.send()?;
    }
    Ok(Some(spots))
}

fn header(message: u64, status: Status) -> FrameHeader {
    FrameHeader {
        stamp: Stamp {
            frame: message,
            ..Stamp::default()
        },
        timing: Timing::default(),
        status,
        ..FrameHeader::default()
    }
}

/// Repeats the message that ends the series until the receiver sends its report.
fn request_report(
    child: &mut Child,
    publisher: &SlicePublisher<u8, FrameHeader>,
    stop: &Stop,
) -> Result<Option<ReceiverReport>, Failure> {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        if stop.is_requested() {
            return Ok(None);
        }
        let mut loan = publisher.loan(1)?;
        *loan.header_mut() = header(0, Status::END);
        loan.send()?;
        sleep(POLL_INTERVAL);
        let ended = child.try_wait().or_fail(ExitKind::Run)?;
        for line in child.read_lines().or_fail(ExitKind::Run)? {
            match serde_json::from_str(&line) {
                Ok(receiver) => return Ok(Some(receiver)),
                Err(_) => output::message(line),
            }
        }
        if ended.is_some() {
            break;
        }
    }
    Err(no_report(child))
}

fn no_report(child: &mut Child) -> Failure {
    for line in child.read_lines().unwrap_or_default() {
        output::message(line);
    }
    Failure::new(ExitKind::Run, "the receiving process does not respond")
}

/// Returns the number of messages whose location is known in both processes, and how many of these messages have the same location.
fn compare(sent: &[Spot], received: &[Spot]) -> (usize, usize) {
    let of = |message: u64| sent.iter().find(move |spot| spot.message == message);
    let pairs = received.iter().filter_map(|spot| Some((spot, of(spot.message)?)));
    let pairs: Vec<_> = pairs.collect();
    let n_same = pairs.iter().filter(|(spot, other)| spot == other).count();
    (pairs.len(), n_same)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copied_message_has_a_different_memory_location() {
        let spot = |message, offset| Spot {
            message,
            inode: 7,
            offset,
        };
        let sent = [spot(0, 64), spot(1, 128), spot(2, 64)];
        assert_eq!(compare(&sent, &sent), (3, 3));
        let received = [spot(1, 128), spot(2, 192), spot(9, 64)];
        assert_eq!(compare(&sent, &received), (2, 1));
    }
}
