//! Topics of large arrays with few chunks.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::time::{Duration, Instant};

use common::{Deployment, shared_memory};
use failure::Stop;
use messages::FrameHeader;
use runtime::{Bus, Delivery, Limits, SendError, SlicePublisher, SliceSubscriber, TopicPlan};

const SOON: Duration = Duration::from_secs(20);
/// Number of elements of every array, with enough bytes to distinguish chunks by their pages.
const LEN: usize = 1 << 20;

/// Returns a plan with one chunk for writing and one for borrowing. The worst case would need nine chunks.
fn plan(delivery: Delivery) -> TopicPlan {
    let limits = Limits::new(2, 2, 2);
    TopicPlan::slices::<u8, FrameHeader>("large".to_owned(), delivery, limits, LEN)
        .with_few_chunks(2)
}

fn send(publisher: &SlicePublisher<u8, FrameHeader>, value: u8) -> Result<usize, SendError> {
    let mut loan = publisher.loan(LEN)?;
    loan.payload_mut().fill(value);
    loan.send()
}

/// Returns the publisher and the subscriber of a topic with both chunks in use.
fn full(
    deployment: &Deployment,
    patience: Duration,
) -> (
    SlicePublisher<u8, FrameHeader>,
    SliceSubscriber<u8, FrameHeader>,
) {
    let bus = deployment.bus("both").with_patience(patience);
    let publisher = bus.slice_publisher("large").unwrap();
    let mut waiter = bus.waiter();
    let subscriber = bus.slice_subscriber("large", &mut waiter).unwrap();
    for value in [1, 2] {
        assert_eq!(send(&publisher, value).unwrap(), 1);
    }
    (publisher, subscriber)
}

/// Returns the mapped memory in the pool of the deployment's only publisher, in bytes. This is its mapping in the sender or in the
/// receiver, whichever is larger.
fn mapped(deployment: &Deployment) -> usize {
    let files = shared_memory(deployment.namespace()).into_iter();
    let is_pool = |text: &String| std::path::Path::new(text).extension() == Some("data".as_ref());
    let pool = files.into_iter().find(is_pool).unwrap();
    let maps = std::fs::read_to_string("/proc/self/smaps").unwrap();
    let kib = |of_pool: &str| -> usize {
        let rss = of_pool.lines().find_map(|line| line.strip_prefix("Rss:"));
        let rss = rss.unwrap().trim().strip_suffix(" kB").unwrap();
        rss.parse().unwrap()
    };
    maps.split(&pool).skip(1).map(kib).max().unwrap() * 1024
}

#[test]
fn a_sender_waits_until_a_chunk_is_released() {
    const N: u8 = 100;
    let deployment = Deployment::new(&[plan(Delivery::Lossless)]);
    let namespace = deployment.namespace().clone();
    let sender = std::thread::Builder::new()
        .spawn(move || {
            let bus = Bus::open(&namespace, "sender", &Stop::new().unwrap()).unwrap();
            let publisher = bus.slice_publisher("large").unwrap();
            assert_eq!(publisher.wait_for_subscribers(1, SOON), 1);
            for value in 0..N {
                assert_eq!(send(&publisher, value).unwrap(), 1);
            }
        })
        .unwrap();
    let bus = deployment.bus("receiver");
    let mut waiter = bus.waiter();
    let subscriber = bus.slice_subscriber::<u8, FrameHeader>("large", &mut waiter);
    let subscriber = subscriber.unwrap();
    let (mut got, mut held) = (Vec::new(), None);
    let begin = Instant::now();
    while got.len() < usize::from(N) && begin.elapsed() < Duration::from_mins(1) {
        waiter.wait(SOON).unwrap();
        // Each sample is held until the next one has arrived, as fusion may do.
        while let Some(sample) = subscriber.receive().unwrap() {
            let value = sample.payload()[0];
            assert!(
                sample.payload().iter().all(|byte| *byte == value),
                "overwritten"
            );
            got.push(value);
            held = Some(sample);
        }
    }
    drop(held);
    assert_eq!(got, (0..N).collect::<Vec<_>>());
    sender.join().unwrap();
}

#[test]
fn chunks_of_a_dropped_receiver_are_released() {
    let deployment = Deployment::new(&[plan(Delivery::Lossless)]);
    let (publisher, subscriber) = full(&deployment, SOON);
    let held = subscriber.receive().unwrap().unwrap();
    drop((held, subscriber));
    // There is no receiver, but both chunks can be used again.
    for value in [3, 4] {
        assert_eq!(send(&publisher, value).unwrap(), 0);
    }
}

#[test]
fn a_sender_stops_waiting_for_a_chunk_that_is_never_released() {
    let deployment = Deployment::new(&[plan(Delivery::Lossless)]);
    let (publisher, subscriber) = full(&deployment, Duration::from_millis(100));
    let held = subscriber.receive().unwrap().unwrap();
    let error = send(&publisher, 3).unwrap_err();
    assert!(matches!(error, SendError::Stuck { .. }), "{error}");
    assert_eq!(held.payload()[0], 1);
    drop(held);
    assert_eq!(send(&publisher, 3).unwrap(), 1);
}

#[test]
fn a_sender_that_waits_for_a_chunk_stops_on_request() {
    let deployment = Deployment::new(&[plan(Delivery::Lossless)]);
    let (publisher, subscriber) = full(&deployment, Duration::from_mins(10));
    deployment.stop().request();
    let error = send(&publisher, 3).unwrap_err();
    assert!(error.is_stopped(), "{error}");
    drop(subscriber);
}

#[test]
fn with_realtime_delivery_a_sender_never_waits_and_unused_chunks_are_not_mapped() {
    let deployment = Deployment::new(&[plan(Delivery::Realtime)]);
    let bus = deployment.bus("both");
    let publisher = bus.slice_publisher("large").unwrap();
    let mut waiter = bus.waiter();
    let subscriber = bus.slice_subscriber::<u8, FrameHeader>("large", &mut waiter);
    let subscriber = subscriber.unwrap();
    let ahead = mapped(&deployment);
    assert!((2 * LEN..3 * LEN).contains(&ahead), "{ahead} ahead of use");
    let mut held = None;
    for value in 0..50 {
        assert_eq!(send(&publisher, value).unwrap(), 1);
        held = subscriber.latest().unwrap();
        assert_eq!(held.as_ref().unwrap().payload()[LEN - 1], value);
    }
    // The nine chunks are reused, the last released ones first.
    let in_use = mapped(&deployment);
    assert!(
        in_use < 4 * LEN,
        "{in_use} bytes by a receiver that keeps up"
    );
    for value in 50..100 {
        assert_eq!(send(&publisher, value).unwrap(), 1);
    }
    assert_eq!(
        held.unwrap().payload()[0],
        49,
        "a borrowed array is not overwritten"
    );
    assert_eq!(subscriber.latest().unwrap().unwrap().payload()[0], 99);
}
