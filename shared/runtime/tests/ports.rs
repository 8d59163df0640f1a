//! Publishers and subscribers within one process. Tests of faults need real processes, see `supervise`.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::os::unix::fs::MetadataExt as _;
use std::time::{Duration, Instant};

use common::{Deployment, shared_memory};
use failure::Stop;
use messages::{EvidenceHeader, FrameHeader, ViewQuality};
use runtime::{
    Bus, Delivery, Limits, Losses, Patience, PortError, SendError, TopicPlan, Waiter, Woken,
};

const SOON: Duration = Duration::from_secs(20);

fn quality(frame: u64) -> ViewQuality {
    let mut message = ViewQuality::default();
    message.stamp.frame = frame;
    message
}

fn small(delivery: Delivery, buffer: usize) -> TopicPlan {
    TopicPlan::messages::<ViewQuality>("small".to_owned(), delivery, Limits::new(2, buffer, 2))
}

fn frames(delivery: Delivery, max_len: usize) -> TopicPlan {
    let limits = Limits::new(2, 1, 2);
    TopicPlan::slices::<u8, FrameHeader>("frames".to_owned(), delivery, limits, max_len)
}

#[test]
fn a_message_arrives_and_wakes_the_receiver() {
    let deployment = Deployment::new(&[small(Delivery::Realtime, 4)]);
    let (sender, receiver) = (deployment.bus("sender"), deployment.bus("receiver"));
    let publisher = sender.publisher::<ViewQuality>("small").unwrap();
    let mut waiter = receiver.waiter();
    let subscriber = receiver.subscriber::<ViewQuality>("small", &mut waiter).unwrap();
    assert_eq!(subscriber.receive().unwrap(), None);
    assert_eq!(publisher.send(&quality(7)).unwrap(), 1);
    assert_eq!(waiter.wait(SOON).unwrap(), Woken::Message);
    assert_eq!(subscriber.receive().unwrap(), Some(quality(7)));
    assert_eq!(subscriber.receive().unwrap(), None);
    assert_eq!(waiter.wait(Duration::ZERO).unwrap(), Woken::Time);
}

#[test]
fn an_array_is_read_in_place() {
    let deployment = Deployment::new(&[frames(Delivery::Realtime, 1000)]);
    let bus = deployment.bus("both");
    let mut waiter = bus.waiter();
    let publisher = bus.slice_publisher::<u8, FrameHeader>("frames").unwrap();
    let subscriber = bus.slice_subscriber::<u8, FrameHeader>("frames", &mut waiter).unwrap();
    for (len, value) in [(1000, 3), (1, 4), (999, 5), (0, 6)] {
        let mut loan = publisher.loan(len).unwrap();
        assert_eq!(loan.payload_mut().as_ptr().align_offset(64), 0);
        loan.payload_mut().fill(value);
        loan.header_mut().width = len as u32;
        assert_eq!(loan.send().unwrap(), 1);
        let sample = subscriber.receive().unwrap().unwrap();
        assert_eq!(sample.payload(), vec![value; len]);
        assert_eq!(sample.header().width, len as u32);
        assert_eq!(sample.payload().as_ptr().align_offset(64), 0);
    }
}

#[test]
fn an_array_that_is_too_long_is_refused_with_the_numbers() {
    let deployment = Deployment::new(&[frames(Delivery::Realtime, 10)]);
    let bus = deployment.bus("sender");
    let publisher = bus.slice_publisher::<u8, FrameHeader>("frames").unwrap();
    assert_eq!(publisher.max_len(), 10);
    let error = publisher.loan(11).unwrap_err();
    assert_eq!(
        error.to_string(),
        "topic \"frames\" carries at most 10 elements, got 11"
    );
}

#[test]
fn a_loan_that_is_dropped_is_not_sent() {
    let deployment = Deployment::new(&[frames(Delivery::Realtime, 10)]);
    let bus = deployment.bus("both");
    let mut waiter = bus.waiter();
    let publisher = bus.slice_publisher::<u8, FrameHeader>("frames").unwrap();
    let subscriber = bus.slice_subscriber::<u8, FrameHeader>("frames", &mut waiter).unwrap();
    for _ in 0..100 {
        drop(publisher.loan(10).unwrap());
    }
    assert!(subscriber.receive().unwrap().is_none());
}

#[test]
fn a_slow_receiver_gets_the_newest_message_and_the_sender_never_waits() {
    let deployment = Deployment::new(&[frames(Delivery::Realtime, 8)]);
    let bus = deployment.bus("both");
    let mut waiter = bus.waiter();
    let publisher = bus.slice_publisher::<u8, FrameHeader>("frames").unwrap();
    let subscriber = bus.slice_subscriber::<u8, FrameHeader>("frames", &mut waiter).unwrap();
    let held = {
        let mut loan = publisher.loan(8).unwrap();
        loan.payload_mut().fill(200);
        loan.send().unwrap();
        subscriber.receive().unwrap().unwrap()
    };
    for value in 0..100 {
        let mut loan = publisher.loan(8).unwrap();
        loan.payload_mut().fill(value);
        loan.send().unwrap();
    }
    assert_eq!(subscriber.latest().unwrap().unwrap().payload(), [99; 8]);
    assert_eq!(
        held.payload(),
        [200; 8],
        "a borrowed array is not overwritten"
    );
}

#[test]
fn a_receiver_that_may_hold_one_array_gets_the_newest() {
    let limits = Limits::new(1, 3, 1);
    let plan =
        TopicPlan::slices::<u8, FrameHeader>("frames".to_owned(), Delivery::Realtime, limits, 8);
    let deployment = Deployment::new(&[plan]);
    let bus = deployment.bus("both");
    let mut waiter = bus.waiter();
    let publisher = bus.slice_publisher::<u8, FrameHeader>("frames").unwrap();
    let subscriber = bus.slice_subscriber::<u8, FrameHeader>("frames", &mut waiter).unwrap();
    for value in 0..3 {
        let mut loan = publisher.loan(8).unwrap();
        loan.payload_mut().fill(value);
        loan.send().unwrap();
    }
    let newest = subscriber.latest().unwrap().unwrap();
    assert_eq!(newest.payload(), [2; 8]);
    assert!(subscriber.latest().unwrap().is_none());
}

#[test]
fn a_slow_receiver_of_a_lossless_topic_gets_everything_in_order() {
    const N: u64 = 200;
    let deployment = Deployment::new(&[small(Delivery::Lossless, 1)]);
    let namespace = deployment.namespace().clone();
    let sender = std::thread::Builder::new()
        .spawn(move || {
            let bus = Bus::open(&namespace, "sender", &Stop::new().unwrap()).unwrap();
            let publisher = bus.publisher::<ViewQuality>("small").unwrap();
            assert_eq!(publisher.wait_for_subscribers(1, SOON), 1);
            for frame in 0..N {
                assert_eq!(publisher.send(&quality(frame)).unwrap(), 1);
            }
        })
        .unwrap();
    let bus = deployment.bus("receiver");
    let mut waiter = bus.waiter();
    let subscriber = bus.subscriber::<ViewQuality>("small", &mut waiter).unwrap();
    let mut got = Vec::new();
    let begin = Instant::now();
    while got.len() < N as usize && begin.elapsed() < Duration::from_mins(1) {
        waiter.wait(SOON).unwrap();
        while let Some(message) = subscriber.receive().unwrap() {
            got.push(message.stamp.frame);
            if got.len() % 50 == 0 {
                std::thread::sleep(Duration::from_millis(20));
            }
        }
    }
    assert_eq!(got, (0..N).collect::<Vec<_>>());
    sender.join().unwrap();
}

#[test]
fn an_earlier_subscriber_counts_once_it_is_connected() {
    let deployment = Deployment::new(&[small(Delivery::Lossless, 1)]);
    let (sender, receiver) = (deployment.bus("sender"), deployment.bus("receiver"));
    let mut waiter = receiver.waiter();
    let subscriber = receiver.subscriber::<ViewQuality>("small", &mut waiter).unwrap();
    let publisher = sender.publisher::<ViewQuality>("small").unwrap();
    assert_eq!(publisher.n_connected(), 1);
    assert_eq!(
        publisher.wait_for_subscribers(1, Duration::from_millis(50)),
        0
    );
    assert_eq!(subscriber.receive().unwrap(), None);
    assert_eq!(publisher.wait_for_subscribers(1, SOON), 1);
}

#[test]
fn a_receiver_that_was_given_up_is_waited_for_only_as_long_as_after_losses() {
    let deployment = Deployment::new(&[small(Delivery::Lossless, 2)]);
    let sender = deployment.bus("sender");
    let publisher = sender.publisher::<ViewQuality>("small").unwrap();
    Losses::of(sender.namespace()).note("receiver-0").unwrap();
    let begin = Instant::now();
    let mut patience = Patience {
        limit: Duration::from_millis(300),
        after_losses: Duration::from_millis(1),
    };
    // Two receivers are missing, one of which was given up. The publisher waits for the other one.
    assert_eq!(publisher.wait_for_subscribers(2, patience), 0);
    assert!(begin.elapsed() >= patience.limit);
    patience.limit = Duration::from_hours(1);
    assert_eq!(publisher.wait_for_subscribers(1, patience), 0);
}

#[test]
fn a_sender_that_waits_for_a_receiver_stops_on_request() {
    let deployment = Deployment::new(&[small(Delivery::Lossless, 1)]);
    let (publisher, subscriber, waiter) = blocked(&deployment, Duration::from_mins(10));
    let stop = deployment.stop().clone();
    let stopper = std::thread::Builder::new()
        .spawn(move || {
            std::thread::sleep(Duration::from_millis(50));
            stop.request();
        })
        .unwrap();
    let error = publisher.send(&quality(2)).unwrap_err();
    assert!(error.is_stopped(), "{error}");
    stopper.join().unwrap();
    drop((subscriber, waiter));
}

#[test]
fn a_sender_stops_waiting_for_a_receiver_that_never_frees_a_chunk() {
    let deployment = Deployment::new(&[small(Delivery::Lossless, 1)]);
    let (publisher, subscriber, waiter) = blocked(&deployment, Duration::from_millis(100));
    let error = publisher.send(&quality(2)).unwrap_err();
    assert!(matches!(error, SendError::Stuck { .. }), "{error}");
    drop((subscriber, waiter));
}

/// Returns a publisher whose next message has no room.
fn blocked(
    deployment: &Deployment,
    patience: Duration,
) -> (
    runtime::Publisher<ViewQuality>,
    runtime::Subscriber<ViewQuality>,
    Waiter,
) {
    let bus = deployment.bus("both").with_patience(patience);
    let publisher = bus.publisher::<ViewQuality>("small").unwrap();
    let mut waiter = bus.waiter();
    let subscriber = bus.subscriber::<ViewQuality>("small", &mut waiter).unwrap();
    assert_eq!(publisher.send(&quality(1)).unwrap(), 1);
    (publisher, subscriber, waiter)
}

#[test]
fn a_stop_request_ends_a_wait() {
    let deployment = Deployment::new(&[]);
    let waiter = deployment.bus("waiter").waiter();
    assert_eq!(waiter.wait(Duration::ZERO).unwrap(), Woken::Time);
    deployment.stop().request();
    assert_eq!(waiter.wait(SOON).unwrap(), Woken::Stop);
    assert_eq!(waiter.wait(SOON).unwrap(), Woken::Stop);
}

#[test]
fn another_type_is_refused_by_name() {
    let deployment = Deployment::new(&[frames(Delivery::Realtime, 8)]);
    let bus = deployment.bus("wrong");
    for error in [
        bus.slice_publisher::<f32, FrameHeader>("frames").unwrap_err(),
        bus.slice_publisher::<u8, EvidenceHeader>("frames").unwrap_err(),
        bus.publisher::<ViewQuality>("frames").unwrap_err(),
    ] {
        assert!(matches!(error, PortError::WrongType { .. }), "{error}");
        assert!(error.to_string().contains("\"frames\""), "{error}");
    }
}

#[test]
fn a_missing_topic_is_refused() {
    let deployment = Deployment::new(&[]);
    let error = deployment.bus("lost").publisher::<ViewQuality>("small").unwrap_err();
    assert!(matches!(error, PortError::NoSuchTopic { .. }), "{error}");
}

#[test]
fn a_publisher_beyond_the_limit_is_refused() {
    let deployment = Deployment::new(&[small(Delivery::Realtime, 1)]);
    let bus = deployment.bus("greedy");
    let first = bus.publisher::<ViewQuality>("small").unwrap();
    let error = bus.publisher::<ViewQuality>("small").unwrap_err();
    assert!(matches!(error, PortError::Publisher { .. }), "{error}");
    drop(first);
    bus.publisher::<ViewQuality>("small").unwrap();
}

#[test]
fn a_pool_has_its_planned_size_and_is_allocated() {
    let plans = [
        frames(Delivery::Realtime, 1_000_003),
        frames(Delivery::Realtime, 1_000_003).with_few_chunks(2),
        frames(Delivery::Lossless, 1_000_003).with_few_chunks(2),
        small(Delivery::Lossless, 16),
    ];
    for plan in plans {
        let deployment = Deployment::new(core::slice::from_ref(&plan));
        let bus = deployment.bus("sender");
        let slices =
            (plan.max_len() > 1).then(|| bus.slice_publisher::<u8, FrameHeader>("frames").unwrap());
        let messages =
            (plan.max_len() == 1).then(|| bus.publisher::<ViewQuality>("small").unwrap());
        let pool = shared_memory(deployment.namespace())
            .into_iter()
            .find(|name| {
                std::path::Path::new(name)
                    .extension()
                    .is_some_and(|extension| extension == "data")
            })
            .unwrap();
        let file = std::fs::metadata(format!("/dev/shm/{pool}")).unwrap();
        // In addition to the chunks, iceoryx2 keeps a list of them in the same file.
        let (planned, actual) = (plan.pool_bytes(), file.len());
        assert!(
            planned <= actual + actual / 8 && actual <= planned + 4096,
            "{planned} {actual}"
        );
        assert!(file.blocks() * 512 >= file.len(), "not reserved");
        drop((slices, messages));
    }
}

#[test]
fn two_deployments_do_not_exchange_messages() {
    let (one, two) = (
        Deployment::new(&[small(Delivery::Realtime, 4)]),
        Deployment::new(&[small(Delivery::Realtime, 4)]),
    );
    let (bus_one, bus_two) = (one.bus("same"), two.bus("same"));
    let mut waiter = bus_two.waiter();
    let publisher = bus_one.publisher::<ViewQuality>("small").unwrap();
    let subscriber = bus_two.subscriber::<ViewQuality>("small", &mut waiter).unwrap();
    assert_eq!(publisher.send(&quality(1)).unwrap(), 0);
    assert_eq!(subscriber.receive().unwrap(), None);
    assert_ne!(one.namespace().prefix(), two.namespace().prefix());
}
