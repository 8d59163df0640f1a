//! One series of messages from this process to another.

use std::thread::sleep;
use std::time::{Duration, Instant};

use launch::output;
use messages::{FrameHeader, Stamp, Status, Timing, topic};
use runtime::{
    Bus, Child, Delivery, ExitKind, Failure, Launch, Limits, Namespace, OrFail as _, Scheduling,
    SlicePublisher, Stop, TopicPlan, now_nanos, preflight, process_topics,
};
use tracing::Level;

use super::receiver::{Heard, N_PLACED, Spot, WARM_UP, write};

/// Name of the other process.
const RECEIVER: &str = "receiver";
/// How long it may take to begin, and to say what it heard.
const PATIENCE: Duration = Duration::from_secs(30);
const PAUSE: Duration = Duration::from_millis(50);

/// What is sent, and how it is heard.
#[derive(Debug, Clone)]
pub(super) struct Series {
    /// Name of the deployment.
    pub name: String,
    /// Bytes of a message, at least 16.
    pub bytes: usize,
    /// Messages that are measured.
    pub n_messages: u64,
    /// From one message to the next.
    pub interval: Duration,
    /// What the receiver asks of the system's scheduler, and whether it polls.
    pub receiver: Scheduling,
    /// The least important events that it logs.
    pub log: Level,
}

/// What became of a series.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measured {
    /// Messages that were sent of those that are measured.
    pub sent: u64,
    /// What the receiver says.
    pub heard: Heard,
    /// Of how many messages both processes said where they lie.
    pub n_compared: usize,
    /// How many of these lay in the same place for both.
    pub n_same_place: usize,
    /// Bytes that the ports of both processes copied.
    pub copied_bytes: u64,
}

/// Sends a series. `None` if it was stopped.
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
    // Dropped in reverse: ports, topics, bus, and the lock last, which removes every file.
    let lock = namespace.acquire()?;
    preflight(&topics)?;
    let bus = Bus::open(lock.namespace(), "sender", stop)?;
    let _topics = bus.create_topics(&topics)?;
    let publisher = bus.slice_publisher::<u8, FrameHeader>(&topic::frame(0))?;
    let mut child = start(series, lock.namespace())?;
    if publisher.wait_for_subscribers(1, PATIENCE) == 0 && !stop.is_requested() {
        return Err(silent(&mut child));
    }
    let Some(spots) = send(series, &publisher, stop)? else {
        return Ok(None);
    };
    let Some(heard) = ask(&mut child, &publisher, stop)? else {
        return Ok(None);
    };
    let (n_compared, n_same_place) = compare(&spots, &heard.spots);
    let copied_bytes = bus.copies().bytes() + heard.copied_bytes;
    Ok(Some(Measured {
        sent: series.n_messages,
        heard,
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

/// Sends all messages; where the first lay, or `None` if it was stopped.
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

/// Tells the receiver that this was all, until it says what it heard.
fn ask(
    child: &mut Child,
    publisher: &SlicePublisher<u8, FrameHeader>,
    stop: &Stop,
) -> Result<Option<Heard>, Failure> {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        if stop.is_requested() {
            return Ok(None);
        }
        let mut loan = publisher.loan(1)?;
        *loan.header_mut() = header(0, Status::END);
        loan.send()?;
        sleep(PAUSE);
        let ended = child.try_wait().or_fail(ExitKind::Run)?;
        for line in child.read_lines().or_fail(ExitKind::Run)? {
            match serde_json::from_str(&line) {
                Ok(heard) => return Ok(Some(heard)),
                Err(_) => output::message(line),
            }
        }
        if ended.is_some() {
            break;
        }
    }
    Err(silent(child))
}

fn silent(child: &mut Child) -> Failure {
    for line in child.read_lines().unwrap_or_default() {
        output::message(line);
    }
    Failure::new(ExitKind::Run, "the receiving process says nothing")
}

/// Of how many messages both say where they lie, and of how many the same.
fn compare(sent: &[Spot], received: &[Spot]) -> (usize, usize) {
    let of = |message: u64| sent.iter().find(move |it| it.message == message);
    let pairs = received.iter().filter_map(|it| Some((it, of(it.message)?)));
    let pairs: Vec<_> = pairs.collect();
    let n_same = pairs.iter().filter(|(it, other)| it == other).count();
    (pairs.len(), n_same)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_lies_elsewhere() {
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
