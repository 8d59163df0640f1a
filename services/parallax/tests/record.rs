//! Tests of recorded and replayed runs: the later stages give the same results, bit for bit.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::fs;
use std::path::Path;

use common::started::signal;
use common::{Case, Ended, PLAIN};
use recording::Entry;
use serde_json::{Value, json};

/// Result files without times.
const RESULTS: [&str; 4] = ["pose3d.jsonl", "pose3d.csv", "pose2d.jsonl", "pose3d.trc"];

fn recorded(case: &Case, more: &[&str]) -> Value {
    let arguments = ["record", "deployment.toml", "--out", "run.mcap", "--json"];
    let ended = case.start(&[&arguments[..], more].concat()).wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    serde_json::from_str(&ended.stdout).unwrap()
}

fn replayed(case: &Case, more: &[&str]) -> Ended {
    let ended = case.start(&[&["replay", "run.mcap"], more].concat()).wait();
    case.assert_nothing_left();
    ended
}

fn text(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn a_lossless_replay_from_any_stage_gives_the_same_bits() {
    const N_FRAMES: usize = 6;
    let case = Case::new("again", &[N_FRAMES; 3], PLAIN);
    case.edit(
        "deployment.toml",
        "upright = false",
        "upright = false\nframe_rate_hz = 20",
    );
    let report = recorded(&case, &[]);
    let recording = &report["recording"];
    assert_eq!(recording["complete"], json!(true), "{recording:#}");
    assert_eq!(recording["lost"], json!(0), "{recording:#}");
    for topic in [
        "frame/v1/0",
        "sightings/v1/1",
        "evidence/v5/2",
        "skeletons/v1",
    ] {
        let n = recording["topics"][topic]["messages"].as_u64().unwrap();
        assert!(n >= N_FRAMES as u64, "{topic}: {n}");
    }
    for from in ["pose", "fuse", "triangulate"] {
        let ended = replayed(&case, &["--from", from, "--out", from]);
        assert_eq!(
            ended.status.code(),
            Some(0),
            "from {from}: {}",
            ended.stderr
        );
        for name in RESULTS {
            let [before, after] =
                [case.path("out"), case.path(from)].map(|folder| text(&folder, name));
            assert!(before == after, "{name} differs when replayed from {from}");
        }
    }
    // Another setting gives another result, so results are computed, not copied from the recording.
    let other = ["--from", "fuse", "--out", "other", "--set"];
    replayed(&case, &[&other[..], &["paper.alpha=0.2"]].concat()).ends(0);
    let [before, after] = ["out", "other"].map(|name| text(&case.path(name), "pose3d.jsonl"));
    assert!(before != after);
    replayed(&case, &[&other[..], &["paper.candidates=1"]].concat())
        .ends(3)
        .says("the recording determines this value");
}

#[test]
fn a_truncated_recording_is_replayed_up_to_its_end() {
    let case = Case::new("cut", &[8; 2], PLAIN);
    recorded(&case, &[]);
    let whole = fs::read(case.path("run.mcap")).unwrap();
    case.write("run.mcap", &whole[..whole.len() * 2 / 3]);
    replayed(&case, &["--from", "fuse", "--out", "part"])
        .ends(7)
        .says("incomplete (cut off): read up to byte");
    let [before, after] = ["out", "part"].map(|name| text(&case.path(name), "pose3d.jsonl"));
    let same = before.lines().zip(after.lines()).take_while(|lines| lines.0 == lines.1);
    assert!(same.count() >= 2, "{before}\n{after}");
    assert!(after.lines().count() < 8, "{after}");
}

#[test]
fn omitted_messages_and_existing_files_are_reported() {
    let case = Case::new("less", &[3; 2], PLAIN);
    let report = recorded(&case, &["--without", "pixels", "--without", "evidence"]);
    let topics = &report["recording"]["topics"];
    assert_eq!(topics.get("evidence/v5/0"), None);
    assert!(report["recording"]["bytes"].as_u64().unwrap() < 1_000_000);
    for (from, lacks) in [("pose", "the pixels of the frames"), ("fuse", "evidence")] {
        replayed(&case, &["--from", from]).ends(4).says(lacks);
    }
    replayed(&case, &["--from", "triangulate", "--speed", "4"]).ends(0);
    let [before, after] = ["out", "run-replay"].map(|name| text(&case.path(name), "pose3d.jsonl"));
    assert_eq!(before, after);

    let again = ["record", "deployment.toml", "--out", "run.mcap"];
    case.start(&again).wait().ends(3).says("an earlier run");
    let elsewhere = [&again[..], &["--set", "output=other"]].concat();
    case.start(&elsewhere).wait().ends(2).says("already exists");
    case.write("run.mcap", "something else");
    replayed(&case, &[]).ends(4).says("not an MCAP file");
}

#[test]
fn a_damaged_chunk_of_a_recording_is_reported_and_left_out() {
    const N_FRAMES: usize = 6;
    let case = Case::new("changed", &[N_FRAMES; 2], PLAIN);
    recorded(&case, &["--without", "evidence", "--without", "pixels"]);
    let mut file = fs::read(case.path("run.mcap")).unwrap();
    let recording = recording::scan(&mut std::io::Cursor::new(&file)).unwrap();
    let poses = &recording.tracks["sightings/v1/1"].entries;
    let entry = poses.iter().find(|pose| pose.frame == Some(3)).unwrap();
    // This position is in the content, after the stamp and the times. Six changed bytes of a pose move a joint.
    let at = (entry.offset + entry.len / 2) as usize;
    file[at..at + 6].iter_mut().for_each(|byte| *byte ^= 0x15);
    case.write("run.mcap", &file);

    let ended = replayed(&case, &["--from", "triangulate", "--out", "less", "--json"]).ends(7);
    let Entry { offset, chunk, .. } = entry;
    let named = format!("sightings/v1/1, frame 3, at byte {offset}, in the chunk at byte {chunk}");
    ended.says(&named);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let expected =
        json!({ "topic": "sightings/v1/1", "frame": 3, "offset": offset, "chunk": chunk });
    let damaged = report["recording"]["damaged"].as_array().unwrap();
    assert!(damaged.contains(&expected), "{damaged:?}");
    assert!(
        damaged.iter().all(|one| one["chunk"] == *chunk),
        "{damaged:?}"
    );
    // The frames in the chunk depend on how far the stages were behind.
    let frames = damaged.iter().filter_map(|one| one["frame"].as_u64());
    let hurt: Vec<u64> = frames.collect();
    let first = *hurt.iter().min().unwrap();
    let [before, after] = ["out", "less"].map(|name| text(&case.path(name), "pose3d.jsonl"));
    for (frame, (before, after)) in before.lines().zip(after.lines()).enumerate() {
        let line: Value = serde_json::from_str(after).unwrap();
        let missing = line["views_missing"].as_object().unwrap().len();
        let frame = frame as u64;
        assert_eq!(line["frame"].as_u64(), Some(frame));
        assert!(missing == 0 || hurt.contains(&frame), "{after}");
        assert!(missing > 0 || frame != 3, "{after}");
        assert!(frame >= first || before == after, "{before}\n{after}");
    }
    assert_eq!(after.lines().count(), N_FRAMES, "{after}");

    // The last frames of one view and all frames of the other cannot be read. The replay ends at the same frame as the run.
    for (view, from) in [(0, 4), (1, 0)] {
        let poses = &recording.tracks[&format!("sightings/v1/{view}")].entries;
        for entry in poses.iter().filter(|pose| pose.frame >= Some(from)) {
            let at = (entry.offset + entry.len / 2) as usize;
            file[at..at + 6].iter_mut().for_each(|byte| *byte ^= 0x2a);
        }
    }
    case.write("run.mcap", &file);
    replayed(&case, &["--from", "triangulate", "--out", "least"]).ends(7);
    let least = text(&case.path("least"), "pose3d.jsonl");
    assert_eq!(least.lines().count(), N_FRAMES, "{least}");
}

#[test]
fn a_sender_that_starts_after_the_last_result_is_not_blocked() {
    const N_FRAMES: usize = 12;
    let case = Case::new("after", &[N_FRAMES; 2], PLAIN);
    recorded(&case, &[]);
    let patient = ["supervise.missed_beats=1000", "supervise.hang_limit_s=600"];
    let arguments = [
        "replay",
        "run.mcap",
        "--from",
        "triangulate",
        "--out",
        "late",
    ];
    let patient = ["--set", patient[0], "--set", patient[1]];
    let mut started = case.start(&[&arguments[..], &patient].concat());
    // The frames of this view are not used, because all results exist before this process starts.
    let pid = started.pid_of("replay --stage capture --index 1");
    signal("STOP", pid.into());
    started.until("all results", |folder| {
        let text = |name: &str| fs::read_to_string(folder.join("late").join(name));
        let text = text("pose3d.jsonl").or_else(|_| text("pose3d.jsonl.part"));
        text.is_ok_and(|text| text.lines().count() == N_FRAMES)
    });
    signal("CONT", pid.into());
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    for said in ["before all receivers are connected", "had no room"] {
        assert!(!ended.stderr.contains(said), "{}", ended.stderr);
    }
}

#[test]
fn all_views_at_once_are_recorded_and_replayed_with_any_number_of_workers() {
    let at_once = PLAIN.replace("workers = 2", "workers = 2\nviews = \"all\"");
    let case = Case::new("at-once", &[4; 3], &at_once);
    recorded(&case, &["--without", "pixels"]);
    for from in ["fuse", "triangulate"] {
        let ended = replayed(&case, &["--from", from, "--out", from]);
        assert_eq!(
            ended.status.code(),
            Some(0),
            "from {from}: {}",
            ended.stderr
        );
        let [before, after] = [case.path("out"), case.path(from)];
        let [before, after] = [before, after].map(|folder| text(&folder, "pose3d.jsonl"));
        assert_eq!(before, after, "from {from}");
    }
}
