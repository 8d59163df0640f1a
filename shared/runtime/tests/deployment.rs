//! Opens all ports of a whole deployment at once.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::os::unix::fs::MetadataExt as _;

use common::{Deployment, shared_memory};
use messages::{
    EvidenceHeader, FrameHeader, Health, PairPose, Sightings, Skeletons, ViewQuality, topic,
};
use runtime::{
    Bus, Delivery, Limits, Publisher, SlicePublisher, SliceSubscriber, Subscriber, TopicPlan,
    Waiter, process_topics,
};

const N_VIEWS: usize = 8;
const N_WORKERS: usize = 3;

/// The names of all processes.
fn processes() -> Vec<String> {
    let stages = ["capture", "pose", "quality"];
    let per_view = (0..N_VIEWS).flat_map(|view| stages.map(|stage| format!("{stage}-{view}")));
    per_view
        .chain((0..N_WORKERS).map(|worker| format!("fuse-{worker}")))
        .chain(["triangulate".to_owned(), "results".to_owned()])
        .collect()
}

/// Returns topics with room for exactly the ports that the test opens.
fn topics(delivery: Delivery) -> Vec<TopicPlan> {
    let large = |receivers| Limits::new(receivers, 1, 2);
    let small = |receivers| Limits::new(receivers, 8, 2);
    let mut topics = Vec::new();
    for view in 0..N_VIEWS {
        let frame = topic::frame(view);
        let frames = TopicPlan::slices::<u8, FrameHeader>(frame, delivery, large(2), 30_000);
        let evidence = topic::evidence(view);
        let evidence =
            TopicPlan::slices::<f32, EvidenceHeader>(evidence, delivery, large(N_WORKERS), 50_000);
        let (pose, quality) = (topic::sightings(view), topic::view_quality(view));
        topics.extend([
            frames,
            evidence.with_few_chunks(3),
            TopicPlan::messages::<Sightings>(pose, delivery, small(N_WORKERS + 3)),
            TopicPlan::messages::<ViewQuality>(quality, delivery, small(N_WORKERS + 1)),
        ]);
    }
    topics.extend((0..N_WORKERS).map(|worker| {
        TopicPlan::messages::<PairPose>(topic::pair_pose(worker), delivery, small(2))
    }));
    topics.push(TopicPlan::messages::<Skeletons>(
        topic::skeletons(),
        delivery,
        small(1),
    ));
    topics.extend(processes().iter().flat_map(|process| process_topics(process)));
    topics
}

/// The ports of all processes, each with its own bus.
#[derive(Default)]
struct Ports {
    frames_out: Vec<SlicePublisher<u8, FrameHeader>>,
    frames_in: Vec<SliceSubscriber<u8, FrameHeader>>,
    evidence_out: Vec<SlicePublisher<f32, EvidenceHeader>>,
    evidence_in: Vec<SliceSubscriber<f32, EvidenceHeader>>,
    poses_out: Vec<Publisher<Sightings>>,
    poses_in: Vec<Subscriber<Sightings>>,
    quality_out: Vec<Publisher<ViewQuality>>,
    quality_in: Vec<Subscriber<ViewQuality>>,
    pairs_out: Vec<Publisher<PairPose>>,
    pairs_in: Vec<Subscriber<PairPose>>,
    result_out: Vec<Publisher<Skeletons>>,
    result_in: Vec<Subscriber<Skeletons>>,
    health_out: Vec<Publisher<Health>>,
    kept: Vec<(Waiter, Bus)>,
}

impl Ports {
    fn open(&mut self, deployment: &Deployment, process: &str) {
        let bus = deployment.bus(process);
        let mut waiter = bus.waiter();
        self.health_out.push(bus.publisher(&topic::health(process)).unwrap());
        let (stage, index) = process.split_once('-').unwrap_or((process, "0"));
        let index = index.parse().unwrap();
        match stage {
            "capture" => self.frames_out.push(bus.slice_publisher(&topic::frame(index)).unwrap()),
            "pose" => self.open_pose(&bus, &mut waiter, index),
            "quality" => {
                self.poses_in
                    .push(bus.subscriber(&topic::sightings(index), &mut waiter).unwrap());
                self.quality_out.push(bus.publisher(&topic::view_quality(index)).unwrap());
            }
            "fuse" => self.open_fuse(&bus, &mut waiter, index),
            _ => self.open_last(&bus, &mut waiter, stage == "results"),
        }
        self.kept.push((waiter, bus));
    }

    fn open_pose(&mut self, bus: &Bus, waiter: &mut Waiter, view: usize) {
        self.frames_in.push(bus.slice_subscriber(&topic::frame(view), waiter).unwrap());
        self.poses_out.push(bus.publisher(&topic::sightings(view)).unwrap());
        self.evidence_out.push(bus.slice_publisher(&topic::evidence(view)).unwrap());
    }

    fn open_fuse(&mut self, bus: &Bus, waiter: &mut Waiter, worker: usize) {
        for view in 0..N_VIEWS {
            self.evidence_in
                .push(bus.slice_subscriber(&topic::evidence(view), waiter).unwrap());
            self.poses_in.push(bus.subscriber(&topic::sightings(view), waiter).unwrap());
            self.quality_in
                .push(bus.subscriber(&topic::view_quality(view), waiter).unwrap());
        }
        self.pairs_out.push(bus.publisher(&topic::pair_pose(worker)).unwrap());
    }

    /// Opens the ports of the service `triangulate`, which publishes the result, and of `record`, which receives everything.
    fn open_last(&mut self, bus: &Bus, waiter: &mut Waiter, records: bool) {
        for view in 0..N_VIEWS {
            self.poses_in.push(bus.subscriber(&topic::sightings(view), waiter).unwrap());
            if records {
                self.frames_in.push(bus.slice_subscriber(&topic::frame(view), waiter).unwrap());
                self.quality_in
                    .push(bus.subscriber(&topic::view_quality(view), waiter).unwrap());
            }
        }
        for worker in 0..N_WORKERS {
            self.pairs_in.push(bus.subscriber(&topic::pair_pose(worker), waiter).unwrap());
        }
        if records {
            self.result_in.push(bus.subscriber(&topic::skeletons(), waiter).unwrap());
        } else {
            self.result_out.push(bus.publisher(&topic::skeletons()).unwrap());
        }
    }
}

#[test]
fn a_deployment_of_eight_views_opens_all_ports_within_its_memory_plan() {
    runtime::raise_file_limit();
    for delivery in [Delivery::Realtime, Delivery::Lossless] {
        let topics = topics(delivery);
        let processes = processes();
        let deployment = Deployment::new(&topics);
        let mut ports = Ports::default();
        for process in &processes {
            ports.open(&deployment, process);
        }
        // Send one message of each kind, so that all queues exist.
        for publisher in &ports.frames_out {
            assert_eq!(publisher.loan(30_000).unwrap().send().unwrap(), 2);
        }
        for publisher in &ports.evidence_out {
            assert_eq!(publisher.loan(50_000).unwrap().send().unwrap(), N_WORKERS);
        }
        for publisher in &ports.poses_out {
            assert_eq!(
                publisher.send(&Sightings::default()).unwrap(),
                N_WORKERS + 3
            );
        }
        let used: u64 = shared_memory(deployment.namespace())
            .iter()
            .map(|name| std::fs::metadata(format!("/dev/shm/{name}")).unwrap().blocks() * 512)
            .sum();
        let pools: u64 = topics.iter().map(TopicPlan::pool_bytes).sum();
        let overhead = used.saturating_sub(pools) / processes.len() as u64;
        assert!(
            overhead <= 1 << 20,
            "{overhead} bytes a process beyond the pools of {pools}"
        );
    }
}
