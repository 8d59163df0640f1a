//! Arrays are sent without copying, and copies are counted.

use crate::common;

use common::Deployment;
use messages::{FrameHeader, PairPose};
use runtime::{Delivery, Limits, Mapped, TopicPlan, mapped_at};

const PIXELS: &str = "pixels";
const RESULT: &str = "result";
const LEN: usize = 640 * 480 * 3;

fn deployment() -> Deployment {
    let limits = Limits::new(2, 1, 1);
    let realtime = Delivery::Realtime;
    Deployment::new(&[
        TopicPlan::slices::<u8, FrameHeader>(PIXELS.to_owned(), realtime, limits, LEN),
        TopicPlan::messages::<PairPose>(RESULT.to_owned(), realtime, limits),
    ])
}

/// Returns the file and the offset, which are the same in all processes.
fn file(place: &Mapped) -> (u64, u64) {
    (place.inode, place.offset)
}

#[test]
fn every_receiver_reads_pixels_in_place() {
    let deployment = deployment();
    let camera = deployment.bus("camera");
    let readers = ["one", "two"].map(|name| deployment.bus(name));
    let ports = readers.each_ref().map(|bus| {
        let mut waiter = bus.waiter();
        bus.slice_subscriber::<u8, FrameHeader>(PIXELS, &mut waiter).unwrap()
    });
    let publisher = camera.slice_publisher::<u8, FrameHeader>(PIXELS).unwrap();
    for round in 0..9 {
        let mut loan = publisher.loan(LEN).unwrap();
        loan.payload_mut().fill(round);
        let written = mapped_at(loan.payload_mut()).unwrap().unwrap();
        assert!(written.is_writable);
        assert!(written.file.starts_with("/dev/shm"), "{written:?}");
        let prefix = deployment.namespace().prefix();
        let name = written.file.file_name().unwrap().to_str().unwrap();
        assert!(name.starts_with(prefix), "{name}");
        assert_eq!(loan.send().unwrap(), 2);
        for port in &ports {
            let sample = port.receive().unwrap().unwrap();
            assert!(sample.payload().iter().all(|value| *value == round));
            let read = mapped_at(sample.payload()).unwrap().unwrap();
            assert_eq!(file(&read), file(&written));
            assert!(!read.is_writable, "a reader cannot change it");
        }
    }
    let copied = readers.each_ref().map(|reader| reader.copies().bytes());
    assert_eq!((camera.copies().bytes(), copied), (0, [0, 0]));
}

#[test]
fn arrays_that_are_kept_count_as_copies() {
    let deployment = deployment();
    let (camera, recorder) = (deployment.bus("camera"), deployment.bus("recorder"));
    let mut waiter = recorder.waiter();
    let port = recorder.slice_subscriber::<u8, FrameHeader>(PIXELS, &mut waiter).unwrap();
    let publisher = camera.slice_publisher::<u8, FrameHeader>(PIXELS).unwrap();
    let mut loan = publisher.loan(1000).unwrap();
    loan.payload_mut().fill(7);
    loan.send().unwrap();
    let kept = port.copy_of(&port.receive().unwrap().unwrap());
    assert_eq!(kept, [7; 1000]);
    assert_eq!(
        mapped_at(&kept).unwrap(),
        None,
        "it is not in shared memory"
    );
    assert_eq!(recorder.copies().bytes(), 1000);
    assert_eq!(camera.copies().bytes(), 0);
}

#[test]
fn messages_are_copied_once_when_sent_and_once_when_received() {
    let deployment = deployment();
    let (from, to) = (deployment.bus("from"), deployment.bus("to"));
    let mut waiter = to.waiter();
    let subscriber = to.subscriber::<PairPose>(RESULT, &mut waiter).unwrap();
    let publisher = from.publisher::<PairPose>(RESULT).unwrap();
    for n in 1..4 {
        publisher.send(&PairPose::default()).unwrap();
        assert!(subscriber.receive().unwrap().is_some());
        let bytes = n * size_of::<PairPose>() as u64;
        assert_eq!([&from, &to].map(|end| end.copies().bytes()), [bytes; 2]);
    }
    assert!(subscriber.receive().unwrap().is_none());
}
