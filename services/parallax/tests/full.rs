//! Tests of runs with too little disk space or shared memory.
#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

use crate::common;

use std::fs;

use common::{Case, PLAIN, Started};
use serde_json::{Value, json};

#[test]
fn a_full_disk_ends_no_process_and_unwritten_results_are_counted() {
    let case = Case::new("disk", &[40; 2], PLAIN);
    fs::create_dir(case.path("out")).unwrap();
    let script = "mount -t tmpfs -o size=400k tmpfs out\n\
                  code=0; \"$PARALLAX\" run deployment.toml --json || code=$?\n\
                  cp -r out copy; exit $code";
    let Some(started) = Started::in_mount_namespace(case.folder(), script) else {
        eprintln!("skipped: no private file system may be mounted here");
        return;
    };
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let summary = &report["recorded"]["summary"];
    // Every frame was computed, but not every frame was written, and no process was restarted.
    assert_eq!(report["restarts"], json!([]), "{}", ended.stderr);
    let [n_written, n_lost] =
        ["frames", "frames_not_recorded"].map(|name| summary[name].as_u64().unwrap());
    assert_eq!(n_written + n_lost, 40);
    assert!(n_written > 0 && n_lost > 0, "{summary:#}");
    assert!(summary["writes_failed"].as_u64() > Some(10), "{summary:#}");
    let why = summary["first_failure"].as_str().unwrap();
    assert!(why.contains("No space left"), "{why}");
    ended.says("No space left");
    // Every written line is complete, and a file that lacks lines keeps its temporary name.
    for name in ["pose3d.jsonl.part", "pose2d.jsonl.part"] {
        let text = fs::read_to_string(case.path("copy").join(name)).unwrap();
        assert!(text.ends_with('\n'), "{name} ends in the middle of a line");
        let lines = text.lines().map(serde_json::from_str::<Value>);
        let frames: Vec<u64> = lines.map(|line| line.unwrap()["frame"].as_u64().unwrap()).collect();
        assert!(frames.len() > 3 && frames.is_sorted(), "{frames:?}");
        assert!(frames.last() < Some(&39), "the disk was not full");
        assert!(name.starts_with("pose2d") || frames.len() as u64 == n_written);
    }
    let text = fs::read_to_string(case.path("copy/summary.json")).unwrap();
    let written: Value = serde_json::from_str(&text).unwrap();
    assert!(written["summary"]["writes_failed"].as_u64() > Some(10));
}

#[test]
fn too_little_shared_memory_is_refused_with_the_numbers() {
    let case = Case::new("room", &[2; 2], PLAIN);
    let script = "mount -t tmpfs -o size=4m tmpfs /dev/shm\n\
                  exec \"$PARALLAX\" run deployment.toml --json";
    let Some(started) = Started::in_mount_namespace(case.folder(), script) else {
        eprintln!("skipped: no private file system may be mounted here");
        return;
    };
    let ended = started.wait().ends(3);
    for words in [
        "MB of shared memory",
        "4 MB are free in /dev/shm",
        "--shm-size=",
    ] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
    assert_eq!(ended.stdout, "");
}

#[test]
fn a_recording_is_refused_if_the_disk_has_too_little_room() {
    let case = Case::new("no-room", &[2; 2], PLAIN);
    fs::create_dir(case.path("disk")).unwrap();
    let script = "mount -t tmpfs -o size=64k tmpfs disk\n\
                  exec \"$PARALLAX\" record deployment.toml --out disk/run.mcap";
    let Some(started) = Started::in_mount_namespace(case.folder(), script) else {
        eprintln!("skipped: no private file system may be mounted here");
        return;
    };
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(4), "{}", ended.stderr);
    for words in [
        "not enough disk space for",
        "2 frames of",
        "kB are free",
        "--without evidence",
    ] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
    assert!(!case.path("out").exists(), "nothing was begun");
}
