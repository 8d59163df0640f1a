//! Tests that a receiver that polls continuously gets the same messages, and that its sender sends no wake-up.

use crate::common;

use core::time::Duration;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use common::Deployment;
use messages::FrameHeader;
use runtime::{Bus, Delivery, Limits, TopicPlan, Woken};

const TOPIC: &str = "pixels";
/// Time after which an event counts as never happening.
const WATCHDOG: Duration = Duration::from_mins(1);

fn deployment(delivery: Delivery) -> Deployment {
    let limits = Limits::new(1, 1, 1);
    let plan = TopicPlan::slices::<u8, FrameHeader>(TOPIC.to_owned(), delivery, limits, 8);
    Deployment::new(&[plan])
}

#[test]
fn a_spinning_receiver_gets_all_messages() {
    for delivery in [Delivery::Realtime, Delivery::Lossless] {
        let deployment = deployment(delivery);
        let is_heard = AtomicBool::new(true);
        let (namespace, stop) = (deployment.namespace(), deployment.stop());
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let bus = Bus::open(namespace, "camera", stop).unwrap();
                let publisher = bus.slice_publisher::<u8, FrameHeader>(TOPIC).unwrap();
                assert_eq!(publisher.wait_for_subscribers(1, WATCHDOG), 1);
                for number in 0..100 {
                    let begin = Instant::now();
                    while !is_heard.swap(false, Ordering::AcqRel) {
                        assert!(
                            begin.elapsed() < WATCHDOG,
                            "number {number} was not received"
                        );
                        std::thread::yield_now();
                    }
                    let mut loan = publisher.loan(1).unwrap();
                    loan.payload_mut()[0] = number;
                    loan.send().unwrap();
                }
            });
            let bus = deployment.bus("pose").with_spin(true);
            let mut waiter = bus.waiter();
            let port = bus.slice_subscriber::<u8, FrameHeader>(TOPIC, &mut waiter).unwrap();
            let (mut received, begin) = (Vec::new(), Instant::now());
            while received.len() < 100 && begin.elapsed() < WATCHDOG {
                // The waiter does not sleep, so it always returns because of the time limit.
                assert_eq!(waiter.wait(WATCHDOG).unwrap(), Woken::Time);
                if let Some(sample) = port.receive().unwrap() {
                    received.push(sample.payload()[0]);
                    is_heard.store(true, Ordering::Release);
                }
            }
            assert_eq!(received, (0..100).collect::<Vec<u8>>());
        });
    }
}

#[test]
fn a_spinning_waiter_without_subscribers_sleeps() {
    let deployment = deployment(Delivery::Realtime);
    let bus = deployment.bus("camera").with_spin(true);
    let waiter = bus.waiter();
    let begin = Instant::now();
    assert_eq!(waiter.wait(Duration::from_millis(30)).unwrap(), Woken::Time);
    assert!(begin.elapsed() >= Duration::from_millis(30));
}

#[test]
fn a_spinning_waiter_stops_on_request_and_makes_progress() {
    let deployment = deployment(Delivery::Realtime);
    let bus = deployment.bus("pose").with_spin(true);
    let mut waiter = bus.waiter();
    let _port = bus.slice_subscriber::<u8, FrameHeader>(TOPIC, &mut waiter).unwrap();
    let before = bus.progress().count();
    for _ in 0..1000 {
        assert_eq!(waiter.wait(WATCHDOG).unwrap(), Woken::Time);
    }
    assert!(bus.progress().count() > before);
    deployment.stop().request();
    assert_eq!(waiter.wait(WATCHDOG).unwrap(), Woken::Stop);
    let ended = waiter.linger(|| 0, || Ok::<(), runtime::WaitError>(()));
    ended.unwrap();
}
