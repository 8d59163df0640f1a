//! Round trip between two processes that sleep until they are woken.
//!
//! The messages are 64 bytes, an image of 172 x 224 pixels (115 584 bytes), and the response maps of all levels of an image (40 megabytes).
//! All are sent without copying. For comparison, the same maps are also copied once in each direction, which is the best that a socket
//! could achieve.
#![expect(clippy::unwrap_used, reason = "a bench fails by panicking")]
#![expect(clippy::print_stdout, reason = "a bench prints its results")]

use std::ffi::OsString;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use failure::Stop;
use messages::EvidenceHeader;
use runtime::{
    Bus, Child, Delivery, Limits, Namespace, Sample, SlicePublisher, SliceSubscriber, TopicPlan,
    Waiter,
};

/// Name, number of `f32` values, and number of rounds of each workload.
const WORKLOADS: [(&str, usize, usize); 4] = [
    ("64 bytes", 16, 2000),
    ("115 584 bytes", 115_584 / 4, 2000),
    ("40 000 000 bytes", 10_000_000, 1000),
    ("40 000 000 bytes, copied", 10_000_000, 60),
];

fn main() {
    let args: Vec<OsString> = std::env::args_os().collect();
    if let [_, role, base, len, copies] = args.as_slice()
        && role == "echo"
    {
        let number = |text: &OsString| text.to_str().unwrap().parse().unwrap();
        return echo(&PathBuf::from(base), number(len), number(copies) == 1);
    }
    for (index, (name, len, rounds)) in WORKLOADS.into_iter().enumerate() {
        measure(name, len, rounds, index == 3);
    }
}

fn plan(topic: &str, len: usize) -> TopicPlan {
    let limits = Limits::new(1, 1, 1);
    TopicPlan::slices::<f32, EvidenceHeader>(topic.to_owned(), Delivery::Realtime, limits, len)
}

type Ends = (
    SlicePublisher<f32, EvidenceHeader>,
    SliceSubscriber<f32, EvidenceHeader>,
    Waiter,
);

fn ends(bus: &Bus, to: &str, from: &str) -> Ends {
    let mut waiter = bus.waiter();
    let subscriber = bus.slice_subscriber(from, &mut waiter).unwrap();
    (bus.slice_publisher(to).unwrap(), subscriber, waiter)
}

/// Writes one value in every page, or all values of `source`.
fn write(publisher: &SlicePublisher<f32, EvidenceHeader>, len: usize, source: Option<&[f32]>) {
    let mut loan = publisher.loan(len).unwrap();
    match source {
        Some(source) => loan.payload_mut().copy_from_slice(source),
        None => loan.payload_mut()[len / 2] = 1.0,
    }
    loan.send().unwrap();
}

fn echo(base: &Path, len: usize, copies: bool) {
    let stop = Stop::on_signals().unwrap();
    let bus = Bus::open(&Namespace::below("b", base).unwrap(), "echo", &stop).unwrap();
    let (publisher, subscriber, waiter) = ends(&bus, "back", "there");
    let mut own = vec![0.0; len];
    while !stop.is_requested() {
        waiter.wait(Duration::from_secs(1)).unwrap();
        while let Some(sample) = subscriber.receive().unwrap() {
            if copies {
                own.copy_from_slice(sample.payload());
            } else {
                black_box(sample.payload()[len / 2]);
            }
            write(&publisher, len, copies.then_some(&own));
        }
    }
}

/// Waits for the other process.
fn answer(
    subscriber: &SliceSubscriber<f32, EvidenceHeader>,
    waiter: &Waiter,
) -> Option<Sample<f32, EvidenceHeader>> {
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_secs(1) {
        waiter.wait(Duration::from_secs(1)).unwrap();
        if let Some(sample) = subscriber.receive().unwrap() {
            return Some(sample);
        }
    }
    None
}

fn measure(name: &str, len: usize, rounds: usize, copies: bool) {
    let base = tempfile::Builder::new().prefix("px").tempdir_in("/dev/shm").unwrap();
    let lock = Namespace::below("b", base.path()).unwrap().acquire().unwrap();
    let stop = Stop::new().unwrap();
    let bus = Bus::open(lock.namespace(), "bench", &stop).unwrap();
    let topics = bus.create_topics(&[plan("there", len), plan("back", len)]).unwrap();
    let (publisher, subscriber, waiter) = ends(&bus, "there", "back");
    let args = [
        "echo".into(),
        base.path().as_os_str().to_owned(),
        len.to_string().into(),
        u8::from(copies).to_string().into(),
    ];
    let child = Child::start(&std::env::current_exe().unwrap(), &args).unwrap();
    publisher.wait_for_subscribers(1, Duration::from_mins(1));
    let mut own = vec![0.0; len];
    let mut micros: Vec<f64> = Vec::new();
    // Wait for the first messages until the other process has started.
    while micros.len() < rounds + 50 {
        let begin = Instant::now();
        write(&publisher, len, copies.then_some(&own));
        if let Some(sample) = answer(&subscriber, &waiter) {
            if copies {
                own.copy_from_slice(sample.payload());
            } else {
                black_box(sample.payload()[len / 2]);
            }
            micros.push(begin.elapsed().as_secs_f64() * 1e6);
        }
    }
    micros.drain(..50);
    micros.sort_by(f64::total_cmp);
    let at = |share: f64| micros[((micros.len() - 1) as f64 * share) as usize];
    println!(
        "{name:>26}: p50 {:8.1} us, p99 {:8.1} us",
        at(0.5),
        at(0.99)
    );
    drop((child, publisher, subscriber, waiter, topics, bus, lock));
}
