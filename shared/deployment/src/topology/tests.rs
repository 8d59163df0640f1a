//! Tests of properties that the processes of every deployment have.

use core::fmt::Write as _;
use std::path::Path;

use proptest::prelude::*;

use super::*;
use crate::capture::Mode;
use crate::{AnyMachine, Loaded};

/// Returns a deployment with a given number of cameras.
fn deployment(n_views: usize, settings: &str) -> Deployment {
    let mut text = "name = 'a'\nrig = 'r'\noutput = 'o'\n".to_owned();
    if settings.contains("[paper]") {
        text.push_str("method = 'paper'\n");
    }
    for view in 0..n_views {
        write!(text, "[[camera]]\nname = 'c{view}'\nsource = 's'\n").unwrap();
    }
    text.push_str(settings);
    let loaded = Loaded::parse(&text, Path::new("d.toml"), &[], &AnyMachine);
    loaded.unwrap().deployment
}

fn recording(without_evidence: bool) -> RecordingPlan {
    RecordingPlan {
        file: PathBuf::new(),
        without_pixels: false,
        without_evidence,
        queue_mb: 1,
        pictures: Vec::new(),
        without_foxglove: true,
    }
}

fn replay(from: Stage) -> Replay {
    Replay {
        file: PathBuf::new(),
        from,
        speed: None,
    }
}

fn of_service<'a>(topology: &'a Topology, service: &str) -> Vec<&'a Process> {
    let processes = topology.processes().iter();
    processes.filter(|process| process.service == service).collect()
}

#[test]
fn all_views_at_once_use_one_worker_for_any_allowed_number() {
    for n_views in 3..=6 {
        let deployment = deployment(n_views, "[paper]\nviews = 'all'\nworkers = 3\n");
        let recording = recording(false);
        let recorded = Topology::new(&deployment, Some(&recording), None);
        let replay = replay(Stage::Triangulate);
        let replayed = Topology::new(&deployment, None, Some(&replay));
        for topology in [&recorded, &replayed] {
            assert_eq!(topology.n_workers(), 1);
            assert_eq!(of_service(topology, "fuse").len(), 1);
            let answers = |process: &Process| {
                let inputs = process.inputs.iter();
                inputs.filter(|input| input.starts_with("pair-pose/")).count()
            };
            for it in topology.processes() {
                let reads = ["triangulate", "results", "record"].contains(&it.service);
                assert_eq!(answers(it), usize::from(reads), "{}", it.name);
            }
            assert_eq!(topology.pairs_of(0).len(), n_views - 1);
        }
        let fused = replayed.process("fuse-0").unwrap();
        assert!(fused.is_replayed && fused.inputs.is_empty());
        assert_eq!(fused.outputs, [topic::pair_pose(0)]);
        assert_eq!(recorded.receivers_of(&topic::pair_pose(0)), 3);
        assert_eq!(replayed.receivers_of(&topic::pair_pose(0)), 2);
        // A replayed pose process sends only to processes that run.
        assert_eq!(recorded.receivers_of(&topic::sightings(0)), 4);
        assert_eq!(replayed.receivers_of(&topic::sightings(0)), 2);
    }
}

#[test]
fn topics_of_a_recorded_deployment_have_the_expected_receivers() {
    let deployment = deployment(3, "[paper]\nerrors = 'n'\nworkers = 2\n");
    let recording = recording(false);
    let topology = Topology::new(&deployment, Some(&recording), None);
    let n = |topic: String| topology.receivers_of(&topic);
    assert_eq!(n(topic::frame(1)), 4, "pose, quality, results, record");
    assert_eq!(
        n(topic::sightings(1)),
        6,
        "quality, fuse twice, triangulate, results, record"
    );
    // Pairs 0-1 and 1-2 belong to the first worker, pair 0-2 to the second.
    assert_eq!([0, 1, 2].map(|view| n(topic::evidence(view))), [3, 2, 3]);
    assert_eq!(n(topic::view_quality(1)), 4, "fuse twice, results, record");
    assert_eq!(n(topic::pair_pose(1)), 3, "triangulate, results, record");
    assert_eq!(n(topic::skeletons()), 2, "results, record");
    let senders = |name: &str| {
        let receiver = topology.process(name).unwrap();
        let senders = topology.senders_to(receiver);
        senders.map(|sender| sender.name.as_str()).collect::<Vec<_>>()
    };
    assert_eq!(senders("capture-1"), [""; 0]);
    assert_eq!(senders("pose-1"), ["capture-1"]);
    assert_eq!(senders("quality-1"), ["pose-1", "capture-1"]);
    let names: Vec<&str> =
        topology.processes().iter().map(|process| process.name.as_str()).collect();
    let expected = "record results triangulate fuse-0 fuse-1 quality-0 quality-1 quality-2 pose-0 pose-1 pose-2 \
                    capture-0 capture-1 capture-2";
    assert_eq!(names.join(" "), expected);
}

const SIZE: ViewSize = ViewSize {
    frame_bytes: 272 * 480 * 3,
    evidence_values: 10_000_000,
    picture_bytes: 0,
};

/// Row of the tests of numbers: name, receivers, queue, borrowed, longest, usual.
type Numbers<'a> = (&'a str, usize, usize, usize, usize, Option<usize>);

fn numbers(rooms: &[Room]) -> Vec<Numbers<'_>> {
    let mut all = Vec::new();
    for it in rooms {
        let topic = it.topic.as_str();
        all.push((
            topic,
            it.receivers,
            it.queued,
            it.borrowed,
            it.longest,
            it.usual,
        ));
    }
    all
}

#[test]
fn topics_have_the_expected_capacities() {
    let settings = "[paper]\nerrors = 'n'\nworkers = 2\n";
    let topology = Topology::new(&deployment(3, settings), None, None);
    let rooms = topology.rooms(Mode::Realtime, &[SIZE; 3], 4);
    assert_eq!(rooms.len(), 4 * 3 + 2 + 1);
    let of_last_view_and_later: [Numbers<'_>; 7] = [
        ("frame/v1/2", 3, 1, 4, 391_680, None),
        ("evidence/v5/2", 2, 1, 1, 10_000_000, Some(2)),
        ("sightings/v1/2", 5, 4, 2, 1, None),
        ("view-quality/v2/2", 5, 4, 2, 1, None),
        ("pair-pose/v3/0", 2, 4, 2, 1, None),
        ("pair-pose/v3/1", 2, 4, 2, 1, None),
        ("skeletons/v1", 1, 4, 2, 1, None),
    ];
    assert_eq!(numbers(&rooms[8..]), of_last_view_and_later);

    // The run is recorded, and nothing may be dropped.
    let recording = recording(false);
    let topology = Topology::new(&deployment(3, settings), Some(&recording), None);
    let rooms = topology.rooms(Mode::Lossless, &[SIZE; 3], 1);
    let of_last_view_and_later: [Numbers<'_>; 7] = [
        ("frame/v1/2", 4, 1, 1, 391_680, None),
        ("evidence/v5/2", 3, 1, 1, 10_000_000, Some(2)),
        ("sightings/v1/2", 6, 16, 2, 1, None),
        ("view-quality/v2/2", 6, 16, 2, 1, None),
        ("pair-pose/v3/0", 3, 16, 2, 1, None),
        ("pair-pose/v3/1", 3, 16, 2, 1, None),
        ("skeletons/v1", 2, 4, 2, 1, None),
    ];
    assert_eq!(numbers(&rooms[8..]), of_last_view_and_later);
}

#[test]
fn the_queue_holds_all_solutions_of_one_frame_of_many_views() {
    let all = deployment(7, "[paper]\nviews = 'all'\n");
    let rooms = Topology::new(&all, None, None).rooms(Mode::Realtime, &[SIZE; 7], 1);
    let answers = rooms.iter().find(|room| room.content == Content::PairPose);
    assert_eq!(answers.map(|answer| answer.queued), Some(7));
}

#[test]
fn every_pair_has_one_worker() {
    for most in 1..12 {
        let deployment = deployment(5, &format!("[paper]\nviews = 'pairs'\nworkers = {most}\n"));
        let topology = Topology::new(&deployment, None, None);
        let mut dealt: Vec<usize> = (0..topology.n_workers())
            .flat_map(|worker| topology.pairs_of(worker))
            .map(|pair| pair.0)
            .collect();
        dealt.sort_unstable();
        assert_eq!(dealt, (0..10).collect::<Vec<_>>(), "{most} workers");
    }
}

#[test]
fn a_view_is_received_by_the_workers_of_its_pairs() {
    let on = |n_views, settings: &str| {
        let topology = Topology::new(&deployment(n_views, settings), None, None);
        [0, 1, 2].map(|view| topology.workers_on(view))
    };
    assert_eq!(on(3, "[paper]\nworkers = 3\n"), [2, 2, 2]);
    let one = "[paper]\nworkers = 4\npairs = [['c1', 'c0'], ['c0', 'c1']]\n";
    assert_eq!(on(3, one), [1, 1, 0]);
}

#[test]
fn one_camera_has_no_worker() {
    let topology = Topology::new(&deployment(1, "[paper]\nworkers = 4\n"), None, None);
    assert_eq!(topology.n_workers(), 0);
    assert_eq!(topology.workers_on(0), 0);
    assert_eq!(of_service(&topology, "fuse").len(), 0);
}

prop_compose! {
    fn any_settings()(
        n_views in 1_usize..=6,
        views in prop::sample::select(vec!["pairs", "all"]),
        workers in 1_usize..=8,
        quality in prop::sample::select(vec!["", "errors = { table = 't' }", "errors = 'n'"]),
        some in prop::option::of(prop::collection::vec((0_usize..6, 1_usize..6), 1..4)),
    ) -> (usize, String) {
        let mut pairs = String::new();
        if let Some(some) = some.filter(|_| views == "pairs" && n_views > 1) {
            let pair = |(first, step): (usize, usize)| {
                let first = first % n_views;
                let second = (first + 1 + step % (n_views - 1)) % n_views;
                format!("['c{first}', 'c{second}']")
            };
            let all: Vec<String> = some.into_iter().map(pair).collect();
            pairs = format!("pairs = [{}]\n", all.join(", "));
        }
        (n_views, format!("[paper]\n{quality}\nviews = '{views}'\nworkers = {workers}\n{pairs}"))
    }
}

proptest! {
    #[test]
    fn every_input_has_one_sender_and_receiver_counts_are_consistent(
        (n_views, settings) in any_settings(),
        without_evidence in prop::option::of(any::<bool>()),
        from in prop::option::of(prop::sample::select(Stage::ALL.to_vec())),
    ) {
        let deployment = deployment(n_views, &settings);
        let recording = without_evidence.map(recording);
        let replay = from.map(replay);
        let topology = Topology::new(&deployment, recording.as_ref(), replay.as_ref());
        let all = topology.processes();

        // Every topic has one sender, and a receiver gets no topic twice.
        let mut outputs: Vec<&String> = all.iter().flat_map(|process| &process.outputs).collect();
        let n_outputs = outputs.len();
        outputs.sort();
        outputs.dedup();
        prop_assert_eq!(outputs.len(), n_outputs);
        for it in all {
            let mut inputs = it.inputs.clone();
            inputs.sort();
            inputs.dedup();
            prop_assert_eq!(inputs.len(), it.inputs.len(), "{}", it.name);
            for input in &it.inputs {
                prop_assert!(outputs.contains(&input), "{} waits for {input}, which has no sender", it.name);
            }
        }
        for topic in &outputs {
            let lists = all.iter().filter(|process| process.inputs.contains(topic)).count();
            prop_assert_eq!(topology.receivers_of(topic), lists);
        }

        // Every topic has capacity for all of its receivers, and a unique name.
        let rooms = topology.rooms(Mode::Realtime, &vec![SIZE; n_views], 1);
        for topic in &outputs {
            let mut its = rooms.iter().filter(|room| room.topic == **topic);
            let room = its.next().map_or(0, |room| room.receivers);
            prop_assert!(room >= topology.receivers_of(topic), "{topic}: {room}");
            prop_assert!(its.next().is_none(), "{topic}: twice");
        }

        // Senders start after their receivers.
        for (nth, sender) in all.iter().enumerate() {
            let before = |topic: &String| all[nth..].iter().all(|process| !process.inputs.contains(topic));
            prop_assert!(sender.outputs.iter().all(before), "{}", sender.name);
        }

        // All processes have the same list of workers.
        let n_workers = of_service(&topology, "fuse").len();
        prop_assert_eq!(n_workers, topology.n_workers());
        for service in ["triangulate", "results", "record"] {
            for it in of_service(&topology, service).into_iter().filter(|process| !process.is_replayed) {
                for worker in 0..8 {
                    let takes = it.inputs.contains(&topic::pair_pose(worker));
                    prop_assert_eq!(takes, worker < n_workers, "{} of {}", it.name, worker);
                }
            }
        }

        // A worker reads the evidence of the views of its pairs only.
        for worker in of_service(&topology, "fuse").into_iter().filter(|process| !process.is_replayed) {
            let pairs = topology.pairs_of(worker.index.unwrap());
            prop_assert!(!pairs.is_empty());
            for view in 0..n_views {
                let is_its = pairs.iter().any(|pair| pair.1.contains(&view));
                prop_assert_eq!(worker.inputs.contains(&topic::evidence(view)), is_its);
            }
        }

        // A replayed process sends the same messages, and receives none.
        let whole = Topology::new(&deployment, recording.as_ref(), None);
        for (it, real) in all.iter().zip(whole.processes()) {
            let stage = Stage::of_name(it.service);
            let stands_in = from.zip(stage).is_some_and(|(from, stage)| stage < from);
            prop_assert_eq!(it.is_replayed, stands_in);
            prop_assert_eq!((&it.name, &it.outputs, it.role), (&real.name, &real.outputs, real.role));
            let inputs = if stands_in { &[][..] } else { &real.inputs[..] };
            prop_assert_eq!(&it.inputs[..], inputs);
        }
        prop_assert_eq!(topology.n_recorders(), 1 + usize::from(recording.is_some()));
    }
}

#[test]
fn encoded_pictures_of_live_cameras_are_sent_only_if_recorded() {
    let deployment = deployment(3, "");
    let plan = RecordingPlan {
        pictures: vec![1],
        ..recording(false)
    };
    let recorded = Topology::new(&deployment, Some(&plan), None);
    let n_receivers = |view| recorded.receivers_of(&topic::picture(view));
    assert_eq!([0, 1, 2].map(n_receivers), [0, 1, 0]);
    let has_output = |view: usize| {
        let capture = recorded.process(&format!("capture-{view}")).unwrap();
        capture.outputs.contains(&topic::picture(view))
    };
    assert_eq!([0, 1, 2].map(has_output), [false, true, false]);
    let sizes = [0, 6_000_000, 0].map(|picture_bytes| ViewSize {
        picture_bytes,
        ..SIZE
    });
    let rooms = recorded.rooms(Mode::Realtime, &sizes, 1);
    let of_pictures: Vec<&Room> =
        rooms.iter().filter(|room| room.content == Content::Picture).collect();
    assert_eq!(of_pictures.len(), 1);
    assert_eq!(
        (of_pictures[0].topic.as_str(), of_pictures[0].longest),
        ("picture/v1/1", 6_000_000)
    );
}
