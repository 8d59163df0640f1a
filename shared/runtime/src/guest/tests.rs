//! Tests of guests: which guests a deployment accepts, and that no process waits for them.

use core::time::Duration;

use messages::Health;

use super::*;
use crate::{Bus, Delivery, DeploymentLock, Limits, Topic, TopicPlan, wait_for_description};
use failure::Stop;

#[test]
fn the_name_of_a_topic_is_split_from_its_version() {
    assert_eq!(parts_of("frame/v1/0"), Some(("frame", "1", "0")));
    assert_eq!(parts_of("skeletons/v1"), Some(("skeletons", "1", "")));
    assert_eq!(parts_of("else"), None);
}

#[test]
fn a_guest_can_be_moved_to_another_thread() {
    fn moves<T: Send>() {}
    moves::<Guest>();
    moves::<GuestPort<u8, messages::FrameHeader>>();
    moves::<Seen<u8, messages::FrameHeader>>();
}

#[test]
fn the_error_for_a_deployment_that_does_not_run_lists_the_running_ones() {
    let base = tempfile::Builder::new().prefix("px").tempdir().unwrap();
    let namespace = Namespace::below("nobody", base.path()).unwrap();
    let error = Guest::open(&namespace).unwrap_err();
    assert!(
        error.to_string().contains("\"nobody\" does not run"),
        "{error}"
    );
    assert!(!namespace.root().exists(), "nothing is created");
}

#[test]
fn a_deployment_that_is_starting_is_waited_for_and_one_that_does_not_run_is_not() {
    const WATCHDOG: Duration = Duration::from_mins(10);
    let base = tempfile::Builder::new().prefix("px").tempdir().unwrap();
    let namespace = Namespace::below("slow", base.path()).unwrap();
    assert!(!wait_for_description(&namespace, WATCHDOG));
    let lock = namespace.acquire().unwrap();
    assert!(!wait_for_description(&namespace, Duration::from_millis(50)));
    let waits = namespace.clone();
    let waiting = std::thread::Builder::new()
        .name("waiting".to_owned())
        .spawn(move || {
            assert!(wait_for_description(&waits, WATCHDOG));
            waits.description().unwrap()
        })
        .unwrap();
    lock.describe(b"what it is").unwrap();
    assert_eq!(waiting.join().unwrap(), "what it is");
    lock.describe(b"else").unwrap();
    assert_eq!(namespace.description().unwrap(), "else");
}

/// Returns a deployment with one lossless topic, and its bus.
fn deployment(base: &Path) -> (DeploymentLock, Bus, Vec<Topic>) {
    let namespace = Namespace::below("here", base).unwrap();
    let lock = namespace.acquire().unwrap();
    let bus = Bus::open(&namespace, "supervisor", &Stop::new().unwrap()).unwrap();
    let limits = Limits::new(1, 2, 1).with_onlookers(MOST_GUESTS);
    let plan = TopicPlan::messages::<Health>("skeletons/v9".to_owned(), Delivery::Lossless, limits);
    let topics = bus.create_topics(&[plan]).unwrap();
    (lock, bus, topics)
}

#[test]
fn no_sender_waits_for_a_guest_and_arrays_that_it_holds_stay_valid() {
    let base = tempfile::Builder::new().prefix("px").tempdir().unwrap();
    let (_lock, bus, _topics) = deployment(base.path());
    let guest = Guest::open(bus.namespace()).unwrap();
    let port = guest.port::<Health, ()>("skeletons/v9").unwrap();
    let publisher = bus.publisher::<Health>("skeletons/v9").unwrap();
    assert_eq!(publisher.n_connected(), 0, "it is no receiver");
    let send = |n_loops| {
        let message = Health {
            n_loops,
            ..Health::default()
        };
        publisher.send(&message).unwrap();
    };
    send(0);
    let held = port.receive().unwrap().unwrap();
    (1..100).for_each(send);
    assert_eq!(held.payload()[0].n_loops, 0);
    let refused = port.receive().map(drop);
    assert!(matches!(refused, Err(ReceiveError::TooManyHeld { .. })));
    drop(held);
    // The queue has kept the first messages, for which there was room.
    let n_loops = || port.receive().unwrap().map(|receive| receive.payload()[0].n_loops);
    assert_eq!([n_loops(), n_loops(), n_loops()], [Some(1), Some(2), None]);
    assert!(!guest.is_over());
}

#[test]
fn an_unsupported_version_and_a_wrong_type_give_different_errors() {
    let base = tempfile::Builder::new().prefix("px").tempdir().unwrap();
    let (lock, bus, topics) = deployment(base.path());
    let guest = Guest::open(bus.namespace()).unwrap();
    let refused = |topic: &str| guest.port::<Health, ()>(topic).unwrap_err().to_string();
    let version = refused("skeletons/v8");
    assert!(
        version.contains("version 9") && version.contains("version 8"),
        "{version}"
    );
    assert!(refused("frame/v1/0").contains("has no topic \"frame/v1/0\""));
    // The topic was missing when it was opened, and exists now.
    let late = guest.absent("skeletons/v9");
    assert!(matches!(late, GuestError::NoSuchTopic { .. }), "{late}");
    let other = guest.port::<u8, messages::FrameHeader>("skeletons/v9");
    assert!(matches!(other, Err(GuestError::WrongType { .. })));
    drop((topics, bus, lock));
    assert!(guest.is_over());
}

#[test]
fn the_number_of_guests_is_limited_and_a_freed_place_can_be_used_again() {
    let base = tempfile::Builder::new().prefix("px").tempdir().unwrap();
    let namespace = Namespace::below("full", base.path()).unwrap();
    fs::create_dir(namespace.root()).unwrap();
    let mut seats: Vec<File> = (0..MOST_GUESTS).map(|_| seat(&namespace).unwrap()).collect();
    let error = seat(&namespace).unwrap_err();
    let pid = std::process::id().to_string();
    assert!(
        matches!(&error, GuestError::Full { most: MOST_GUESTS, guests, .. } if guests[0].contains(&pid)),
        "{error}"
    );
    drop(seats.pop());
    seat(&namespace).unwrap();
}
