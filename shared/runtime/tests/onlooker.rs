//! Tests that an onlooker does not slow down senders and receivers, however slow it is itself.

use core::time::Duration;
use std::time::Instant;

use crate::common::Deployment;
use messages::{FrameHeader, ViewQuality};
use runtime::{Delivery, Limits, TopicPlan, Woken};

/// Limit that shows that no sender waits for an onlooker, because such a wait would take two minutes.
const NOT_STUCK: Duration = Duration::from_mins(1);

fn quality(frame: u64) -> ViewQuality {
    let mut message = ViewQuality::default();
    message.stamp.frame = frame;
    message
}

fn topics(delivery: Delivery) -> [TopicPlan; 2] {
    let limits = Limits::new(1, 2, 1).with_onlookers(2);
    [
        TopicPlan::messages::<ViewQuality>("small".to_owned(), delivery, limits),
        TopicPlan::slices::<u8, FrameHeader>("frames".to_owned(), delivery, limits, 1000),
    ]
}

#[test]
fn a_sender_without_loss_does_not_wait_for_onlookers_and_its_receiver_gets_everything() {
    let deployment = Deployment::new(&topics(Delivery::Lossless));
    let bus = deployment.bus("sender");
    let publisher = bus.publisher::<ViewQuality>("small").unwrap();
    let frames = bus.slice_publisher::<u8, FrameHeader>("frames").unwrap();
    let looking = [deployment.bus("x"), deployment.bus("y")].map(runtime::Bus::as_onlooker);
    let open = |bus: &runtime::Bus| {
        let mut waiter = bus.waiter();
        let small = bus.subscriber::<ViewQuality>("small", &mut waiter).unwrap();
        let large = bus.slice_subscriber::<u8, FrameHeader>("frames", &mut waiter);
        (small, large.unwrap())
    };
    let onlookers = looking.each_ref().map(open);
    assert_eq!(publisher.n_connected(), 0, "they do not count");
    assert_eq!(publisher.wait_for_subscribers(1, Duration::ZERO), 0);
    let receiving = deployment.bus("receiver");
    let mut waiter = receiving.waiter();
    let receiver = receiving.subscriber::<ViewQuality>("small", &mut waiter).unwrap();
    let receiver_of_frames =
        receiving.slice_subscriber::<u8, FrameHeader>("frames", &mut waiter).unwrap();
    assert_eq!(publisher.wait_for_subscribers(1, NOT_STUCK), 1);
    let begin = Instant::now();
    // Every onlooker holds one array and does not take the others.
    let mut held = Vec::new();
    for frame in 0..20 {
        publisher.send(&quality(frame)).unwrap();
        assert_eq!(receiver.receive().unwrap(), Some(quality(frame)));
        let mut loan = frames.loan(1000).unwrap();
        loan.payload_mut().fill(frame as u8);
        loan.send().unwrap();
        let got = receiver_of_frames.receive().unwrap().unwrap();
        assert_eq!(got.payload()[0], frame as u8);
        if frame == 0 {
            held.extend(onlookers.each_ref().map(|onlooker| onlooker.1.receive().unwrap()));
        }
    }
    assert!(begin.elapsed() < NOT_STUCK, "the sender waited");
    assert!(held.iter().all(Option::is_some));
    // The first messages fit into the onlooker's queue; it missed the later ones.
    let first = onlookers[0].0.receive().unwrap();
    assert_eq!(first, Some(quality(0)));
}

#[test]
fn an_onlooker_is_not_woken_and_gets_the_newest_message() {
    let deployment = Deployment::new(&topics(Delivery::Realtime));
    let bus = deployment.bus("sender");
    let publisher = bus.publisher::<ViewQuality>("small").unwrap();
    let looking = deployment.bus("x").as_onlooker();
    let mut waiter = looking.waiter();
    let onlooker = looking.subscriber::<ViewQuality>("small", &mut waiter).unwrap();
    for frame in 0..9 {
        publisher.send(&quality(frame)).unwrap();
    }
    assert_eq!(waiter.wait(Duration::ZERO).unwrap(), Woken::Time);
    assert_eq!(onlooker.latest().unwrap(), Some(quality(8)));
}
