//! Tests of a foreign process that publishes invalid messages into a running deployment. They are refused and counted by cause, and the
//! run continues.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use core::time::Duration;
use std::collections::BTreeSet;
use std::time::Instant;

use common::started::WATCHDOG;
use common::started::signal;
use common::{Case, Ended, PACED, Started, last_taken, planted};
use failure::{Stop, now_nanos};
use messages::{
    EvidenceHeader, FrameHeader, Health, MAX_KEYPOINTS, PairPose, Searched, Sightings,
    SkeletonMessage, Skeletons, Stamp, Timing, topic,
};
use runtime::{Bus, Namespace, PortError, Publisher, SlicePublisher, Waiter};
use serde_json::Value;

const N_FRAMES: usize = 200;

/// A process of the same user that is not part of the deployment, but can access its shared memory.
struct Rogue {
    bus: Bus,
    _waiter: Waiter,
    session: u64,
}

impl Rogue {
    /// Connects to a deployment, and reads its session from the heartbeats.
    fn join(case: &Case) -> Self {
        let namespace = Namespace::new(&case.name).unwrap();
        let bus = Bus::open(&namespace, "rogue", &Stop::new().unwrap()).unwrap();
        let mut waiter = bus.waiter();
        let heartbeats = bus.subscriber::<Health>(&topic::health("results"), &mut waiter);
        let heartbeats = heartbeats.unwrap();
        let session = until(|| heartbeats.latest().unwrap()).session;
        Self {
            bus,
            _waiter: waiter,
            session,
        }
    }

    /// Kills a process, and takes its place as the sender before it is restarted.
    ///
    /// * `victim`: the process, as on its command line.
    fn replace<T>(
        &self,
        started: &mut Started,
        victim: &str,
        publisher: impl Fn(&Bus) -> Result<T, PortError>,
    ) -> T {
        let refused = publisher(&self.bus).err().unwrap();
        assert!(matches!(refused, PortError::Publisher { .. }), "{refused}");
        loop {
            signal("KILL", started.pid_of(victim).into());
            // On a loaded machine the restarted process may be faster.
            let begin = Instant::now();
            while begin.elapsed() < Duration::from_secs(3) {
                if let Ok(port) = publisher(&self.bus) {
                    return port;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    /// Returns a valid stamp and timing.
    fn stamp(&self, view: u32, frame: u64) -> (Stamp, Timing) {
        let now = now_nanos();
        let stamp = Stamp {
            session: self.session,
            frame,
            captured_at_nanos: now,
            view,
            epoch: 0,
        };
        let timing = Timing {
            received_at_nanos: now,
            sent_at_nanos: now,
        };
        (stamp, timing)
    }

    /// Returns stamps and timings with one wrong value each.
    fn wrong_stamps(&self, view: u32) -> [(Stamp, Timing); 6] {
        let (stamp, timing) = self.stamp(view, 5);
        let ahead = now_nanos() + 3_600_000_000_000;
        [
            (
                Stamp {
                    session: 1,
                    ..stamp
                },
                timing,
            ),
            (
                Stamp {
                    view: u32::MAX,
                    ..stamp
                },
                timing,
            ),
            (
                Stamp {
                    captured_at_nanos: ahead,
                    ..stamp
                },
                timing,
            ),
            (
                Stamp {
                    captured_at_nanos: u64::MAX,
                    ..stamp
                },
                timing,
            ),
            (
                Stamp {
                    frame: u64::MAX,
                    ..stamp
                },
                timing,
            ),
            (
                stamp,
                Timing {
                    sent_at_nanos: u64::MAX,
                    ..timing
                },
            ),
        ]
    }
}

/// Sends evidence with sizes that do not match.
fn send_wrong_evidence(
    evidence: &SlicePublisher<f32, EvidenceHeader>,
    (stamp, timing): (Stamp, Timing),
) {
    let mut loan = evidence.loan(9).unwrap();
    loan.payload_mut().fill(f32::NAN);
    *loan.header_mut() = EvidenceHeader {
        stamp,
        timing,
        width: planted::SIZE[0],
        height: planted::SIZE[1],
        n_levels: u32::MAX,
        ..EvidenceHeader::default()
    };
    loan.send().unwrap();
}

/// Makes one value of a pose wrong. The frame decides which one.
fn with_wrong_content(mut pose: Sightings) -> Sightings {
    let kind = pose.stamp.frame % 4;
    let candidate = &mut pose.candidates[0];
    candidate.n_parts = if kind == 0 { u16::MAX } else { 26 };
    pose.n_candidates = if kind == 1 { u32::MAX } else { 1 };
    candidate.x[3] = if kind == 2 { u16::MAX } else { 0 };
    candidate.score = if kind == 3 { f32::NAN } else { 0.0 };
    pose
}

/// Waits until `poll` returns something.
fn until<T>(mut poll: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(value) = poll() {
            return value;
        }
        assert!(begin.elapsed() < WATCHDOG, "waited in vain");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Starts a run of two views, and waits until it has written ten results.
fn start(name: &str, more: &str) -> (Case, Started, Rogue) {
    let more = more.to_owned() + "[supervise]\nmax_restarts = 50\n";
    let case = Case::new(name, &[N_FRAMES; 2], &more);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    let rogue = Rogue::join(&case);
    (case, started, rogue)
}

/// Checks that a run continued to its end. Returns the messages that it refused, as `process cause`.
fn refused(case: &Case, ended: &Ended) -> BTreeSet<String> {
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    assert!(!ended.stderr.contains("panic"), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let restarts = report["restarts"].as_array().unwrap();
    let restarted: BTreeSet<&str> =
        restarts.iter().map(|restart| restart["process"].as_str().unwrap()).collect();
    assert_eq!(restarted.len(), 1, "only the replaced one: {restarted:?}");
    let lines = case.lines("pose3d.jsonl");
    let last = lines.last().unwrap();
    assert_eq!(last["frame"], N_FRAMES as u64 - 1, "{}", ended.stderr);
    let last = last_taken(&lines);
    assert_eq!(last["views_present"].as_array().unwrap().len(), 2, "{last}");
    let processes = report["refused"].as_object().unwrap().iter();
    let all = processes.flat_map(|(process, causes)| {
        let causes = causes.as_object().unwrap().keys();
        causes.map(move |cause| format!("{process} {cause}"))
    });
    all.collect()
}

fn assert_all(refused: &BTreeSet<String>, processes: &[&str], causes: &[&str]) {
    for process in processes {
        for cause in causes {
            let expected = format!("{process} {cause}");
            assert!(
                refused.contains(&expected),
                "{expected} is not in {refused:?}"
            );
        }
    }
}

#[test]
fn a_foreign_process_cannot_publish_another_type_or_compete_with_the_right_sender() {
    let (case, started, rogue) = start("types", PACED);
    let wrong_type = rogue.bus.publisher::<PairPose>(&topic::sightings(0));
    assert!(matches!(wrong_type, Err(PortError::WrongType { .. })));
    let wrong_header = rogue.bus.slice_publisher::<u8, EvidenceHeader>(&topic::frame(0));
    assert!(matches!(wrong_header, Err(PortError::WrongType { .. })));
    let second = rogue.bus.publisher::<Sightings>(&topic::sightings(0));
    assert!(matches!(second, Err(PortError::Publisher { .. })));
    drop(rogue);
    let ended = started.wait().ends(0);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(report["refused"], serde_json::json!({}));
    case.assert_nothing_left();
}

#[test]
fn invalid_poses_and_evidence_are_refused() {
    // With lossless delivery, the run would wait for the frames that the killed process had received.
    let live = PACED.replace("\"paced\"", "\"realtime\"");
    let (case, mut started, rogue) = start("poses", &live);
    let poses: Publisher<Sightings> = rogue.replace(&mut started, "pose --index 1", |bus| {
        bus.publisher(&topic::sightings(1))
    });
    let evidence: SlicePublisher<f32, EvidenceHeader> =
        until(|| rogue.bus.slice_publisher(&topic::evidence(1)).ok());
    let good = |frame: u64| {
        let (stamp, timing) = rogue.stamp(1, frame);
        Sightings {
            stamp,
            timing,
            n_candidates: 1,
            width: planted::SIZE[0],
            height: planted::SIZE[1],
            searched: Searched(u32::MAX),
            evidence_bytes: u64::MAX,
            ..Sightings::default()
        }
    };
    assert_eq!(poses.wait_for_subscribers(3, WATCHDOG), 3);
    assert_eq!(evidence.wait_for_subscribers(1, WATCHDOG), 1);
    // A realtime receiver may skip messages that are sent too fast.
    let pause = || std::thread::sleep(Duration::from_millis(100));
    for (stamp, timing) in rogue.wrong_stamps(1) {
        let wrong = Sightings {
            stamp,
            timing,
            ..good(0)
        };
        poses.send(&wrong).unwrap();
        send_wrong_evidence(&evidence, (stamp, timing));
        pause();
    }
    // The stamp is valid, and its frame may be due, but the content is wrong.
    let next = case.lines("pose3d.jsonl").len() as u64;
    for frame in next..next + 24 {
        poses.send(&with_wrong_content(good(frame))).unwrap();
        pause();
    }
    // Evidence is held until its frame is due, so this evidence is about a later frame.
    let to_come = rogue.stamp(1, case.lines("pose3d.jsonl").len() as u64 + 8);
    send_wrong_evidence(&evidence, to_come);
    drop((poses, evidence, rogue));
    let refused = refused(&case, &started.wait());
    let stamps = ["session", "sender", "time"];
    assert_all(&refused, &["triangulate", "fuse-0", "results"], &stamps);
    assert_all(&refused, &["triangulate"], &["size", "index", "number"]);
}

#[test]
fn frames_with_wrong_sizes_are_refused() {
    let (case, mut started, rogue) = start("frames", PACED);
    let frames: SlicePublisher<u8, FrameHeader> =
        rogue.replace(&mut started, "capture --index 0", |bus| {
            bus.slice_publisher(&topic::frame(0))
        });
    let send = |header: FrameHeader, n_bytes: usize| {
        let mut loan = frames.loan(n_bytes).unwrap();
        loan.payload_mut().fill(7);
        *loan.header_mut() = header;
        loan.send().unwrap();
    };
    assert_eq!(frames.wait_for_subscribers(2, WATCHDOG), 2);
    for (stamp, timing) in rogue.wrong_stamps(0) {
        send(
            FrameHeader {
                stamp,
                timing,
                ..FrameHeader::default()
            },
            1,
        );
    }
    for size in [[0, 1], [u32::MAX; 2], [1 << 31, 1 << 31], [96, 127]] {
        let (stamp, timing) = rogue.stamp(0, 50);
        let header = FrameHeader {
            stamp,
            timing,
            width: size[0],
            height: size[1],
            ..FrameHeader::default()
        };
        send(header, 96 * 128 * 3);
    }
    drop((frames, rogue));
    let refused = refused(&case, &started.wait());
    let causes = ["session", "sender", "time", "size"];
    assert_all(&refused, &["pose-0", "results"], &causes);
}

#[test]
fn invalid_pairs_are_refused() {
    let (case, mut started, rogue) = start("pairs", PACED);
    let pairs: Publisher<PairPose> = rogue.replace(&mut started, "fuse --index 0", |bus| {
        bus.publisher(&topic::pair_pose(0))
    });
    assert_eq!(pairs.wait_for_subscribers(2, WATCHDOG), 2);
    for (stamp, timing) in rogue.wrong_stamps(0) {
        let wrong = PairPose {
            stamp,
            timing,
            ..PairPose::default()
        };
        pairs.send(&wrong).unwrap();
    }
    for frame in 0..N_FRAMES as u64 {
        let (stamp, timing) = rogue.stamp(0, frame);
        let mut wrong = PairPose {
            stamp,
            timing,
            n_hypotheses: if frame % 3 == 0 { u32::MAX } else { 2 },
            views: if frame % 3 == 1 {
                [u32::MAX; 2]
            } else {
                [0, 1]
            },
            ..PairPose::default()
        };
        wrong.hypotheses[0].energy = f64::NAN;
        pairs.send(&wrong).unwrap();
    }
    drop((pairs, rogue));
    let refused = refused(&case, &started.wait());
    let stamps = ["session", "time"];
    assert_all(&refused, &["triangulate", "results"], &stamps);
    assert_all(&refused, &["triangulate"], &["index", "sender", "size"]);
}

/// Returns a result that is accepted, with numbers that Parallax never sends.
fn odd_result(stamp: Stamp, timing: Timing) -> Box<Skeletons> {
    let mut result = Box::<Skeletons>::default();
    (result.stamp, result.timing) = (stamp, timing);
    (result.views_present, result.n_seen, result.n_people) = (u32::MAX, u32::MAX, 1);
    result.people[0] = SkeletonMessage {
        id: u64::MAX,
        n_joints: 14,
        n_keypoints: MAX_KEYPOINTS as u32,
        n_views: 2,
        views_used: u32::MAX,
        n_pairs: u32::MAX,
        sides: messages::Sides(9),
        kept: messages::Kept(9),
        facing_margin: f64::NAN,
        sides_margin: f64::NAN,
        stature_m: f64::NAN,
        body_deviation: f64::NAN,
        ..SkeletonMessage::default()
    };
    result
}

#[test]
fn invalid_results_and_heartbeats_are_refused() {
    let (case, mut started, rogue) = start("results", PACED);
    let results: Publisher<Skeletons> = rogue.replace(&mut started, "triangulate", |bus| {
        bus.publisher(&topic::skeletons())
    });
    let heartbeats: Option<Publisher<Health>> =
        rogue.bus.publisher(&topic::health("triangulate")).ok();
    let (stamp, timing) = rogue.stamp(0, 20);
    let good = odd_result(stamp, timing);
    assert_eq!(results.wait_for_subscribers(1, WATCHDOG), 1);
    for (stamp, timing) in rogue.wrong_stamps(0) {
        results
            .send(&Skeletons {
                stamp,
                timing,
                ..*good
            })
            .unwrap();
    }
    let changes: [fn(&mut Skeletons); 7] = [
        |frame| frame.people[0].n_views = u32::MAX,
        |frame| frame.people[0].n_joints = u32::MAX,
        |frame| (frame.people[0].n_views, frame.people[0].n_joints) = (17, 33),
        |frame| frame.n_people = 9,
        |frame| (frame.n_people, frame.people[1]) = (2, frame.people[0]),
        |frame| frame.people[0].id = 0,
        |frame| frame.people[0].joints[3].in_world[1] = f64::NAN,
    ];
    for change in changes {
        let mut changed = good.clone();
        change(&mut changed);
        results.send(&changed).unwrap();
    }
    if let Some(heartbeats) = heartbeats {
        for session in [rogue.session, 1] {
            let wrong = Health {
                session,
                pid: 1,
                epoch: 1,
                n_sent: u64::MAX,
                refused: [u64::MAX; 6],
                ..Health::default()
            };
            heartbeats.send(&wrong).unwrap();
        }
    }
    drop((results, rogue));
    let refused = refused(&case, &started.wait());
    let causes = ["session", "sender", "time", "size", "number"];
    assert_all(&refused, &["results"], &causes);
}
