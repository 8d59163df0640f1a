//! Tests of complete deployments of real processes, with interruptions and faults.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::fs;
use std::process::Command;

use common::started::{processes, signal};
use common::{Case, PACED, PLAIN, Started};
use serde_json::{Value, json};

/// Returns the frame numbers of a run's results.
fn frames(lines: &[Value]) -> Vec<u64> {
    lines.iter().map(|line| line["frame"].as_u64().unwrap()).collect()
}

#[test]
fn an_interrupted_run_ends_cleanly() {
    // Like `kill`, sends the signal only to the parent; like a terminal, sends it to all processes at once.
    for (name, sign) in [("int-one", 1), ("int-all", -1)] {
        let case = Case::new(name, &[400; 2], PACED);
        let mut started = case.start(&["run", "deployment.toml"]);
        started.until("three frames", |_| case.lines("pose3d.jsonl").len() >= 3);
        signal("INT", sign * started.id());
        let ended = started.wait();
        assert_eq!(ended.status.code(), Some(130), "{name}: {}", ended.stderr);
        case.assert_nothing_left();
        let lines = case.lines("pose3d.jsonl");
        assert!(
            (3..400).contains(&lines.len()),
            "{name}: {} frames",
            lines.len()
        );
    }
}

#[test]
fn signals_to_all_processes_at_once_end_the_run_in_order() {
    // Sends signals in three ways: like systemd, to all processes of any group; like `timeout`, twice to the command; like a terminal that
    // is closed, twice to its processes.
    for (name, signals, to_all) in [
        ("unit", &["TERM"][..], true),
        ("timeout", &["TERM", "TERM"], false),
        ("hangup", &["HUP", "HUP"], false),
        ("session", &["TERM", "HUP"], true),
    ] {
        let case = Case::new(name, &[400; 2], PACED);
        let mut started = case.start(&["run", "deployment.toml"]);
        started.until("three frames", |_| case.lines("pose3d.jsonl").len() >= 3);
        let children = processes(case.folder()).into_iter().map(|process| process.0.into());
        let run = started.id();
        let children: Vec<i64> = children.filter(|_| to_all).collect();
        for sent in signals {
            // Children get the signal first, and must not act on it themselves.
            // A process that has ended after the first signal does not get the second.
            let all = children.iter().chain([&run]).map(i64::to_string);
            let script = format!("kill -s {sent} {} 2>&-", all.collect::<Vec<_>>().join(" "));
            Command::new("sh").args(["-c", &script]).status().unwrap();
        }
        let ended = started.wait();
        assert_eq!(ended.status.code(), Some(130), "{name}: {}", ended.stderr);
        case.assert_nothing_left();
        assert!(!ended.stderr.contains("restart"), "{}", ended.stderr);
        let finished = case.path("out/summary.json");
        assert!(finished.exists(), "{name}: {}", ended.stderr);
    }
}

#[test]
fn a_killed_pose_process_is_restarted_and_its_gap_is_reported() {
    let case = Case::new("kill-pose", &[100; 3], PACED);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    let pid = started.pid_of("pose --index 1");
    signal("KILL", pid.into());
    let ended = started.wait();
    case.assert_nothing_left();
    let lines = case.lines("pose3d.jsonl");
    assert_eq!(
        frames(&lines),
        (0..100).collect::<Vec<_>>(),
        "{}: {}",
        ended.status,
        ended.stderr
    );
    let all = json!(["a", "b", "c"]);
    let without = lines.iter().filter(|line| line["views_present"] != all);
    let without: Vec<_> = without.map(|without| without["views_missing"].clone()).collect();
    assert!(
        without.iter().all(|missing| *missing == json!({ "b": "process lost" })),
        "{without:?}"
    );
    assert_eq!(lines[99]["views_present"], all, "the view is not back");
    // A lost process is reported even if no frame lacks its view.
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(
        report["restarts"],
        json!([{ "process": "pose-1", "restarts": 1 }]),
        "{}",
        ended.stderr
    );
    let missing = &report["recorded"]["summary"]["frames_with_views_missing"];
    assert_eq!(*missing, json!(without.len()));
}

#[test]
fn a_view_whose_footage_ends_early_is_missing_afterwards() {
    let case = Case::new("short", &[12, 12, 7], PLAIN);
    let ended = case.run().ends(7);
    let lines = case.lines("pose3d.jsonl");
    assert_eq!(
        frames(&lines),
        (0..12).collect::<Vec<_>>(),
        "{}",
        ended.stderr
    );
    for (frame, line) in lines.iter().enumerate() {
        let views: &[&str] = if frame < 7 {
            &["a", "b", "c"]
        } else {
            &["a", "b"]
        };
        assert_eq!(line["views_present"], json!(views), "frame {frame}");
        let missing = if frame < 7 {
            json!({})
        } else {
            json!({ "c": "end of footage" })
        };
        assert_eq!(line["views_missing"], missing, "frame {frame}");
    }
}

#[test]
fn a_killed_results_process_does_not_stop_others_and_counts_missed_frames() {
    let case = Case::new("kill-results", &[100; 2], PACED);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    let pid = started.pid_of("results");
    signal("KILL", pid.into());
    let ended = started.wait();
    case.assert_nothing_left();
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(
        report["restarts"],
        json!([{ "process": "results", "restarts": 1 }]),
        "{}",
        ended.stderr
    );
    let frames = frames(&case.lines("pose3d.jsonl"));
    assert!(frames.is_sorted_by(|a, b| a < b), "{frames:?}");
    assert_eq!(
        (frames[0], frames.last()),
        (0, Some(&99)),
        "{}: {}",
        ended.status,
        ended.stderr
    );
    assert_eq!(ended.status.code(), Some(7), "{report:#}\n{}", ended.stderr);
}

#[test]
fn an_output_folder_belongs_to_one_run_at_a_time() {
    let [first, second] = ["first", "second"].map(|name| Case::new(name, &[400; 2], PACED));
    let mut started = first.start(&["run", "deployment.toml"]);
    started.until("three frames", |_| first.lines("pose3d.jsonl").len() >= 3);
    let out = first.path("out");
    let into = ["--out", out.to_str().unwrap()];
    let ended = second.start(&[&["run", "deployment.toml"][..], &into].concat());
    let ended = ended.wait_among_others().ends(3);
    for said in [&format!("process {}", started.id()), &first.name] {
        assert!(ended.stderr.contains(said), "{said}: {}", ended.stderr);
    }
    second.assert_nothing_left();
    // A dead run does not block a new one, and the lines of its files are complete.
    signal("KILL", started.id());
    assert_eq!(started.wait_among_others().status.code(), None);
    let more = ["--set", "capture.mode=lossless"];
    let ended = second.start(&[&["run", "deployment.toml"][..], &into, &more].concat());
    let ended = ended.wait_among_others();
    assert_ne!(ended.status.code(), Some(1), "{}", ended.stderr);
    assert!(
        !ended.stderr.contains("is being written to"),
        "{}",
        ended.stderr
    );
    first.start(&["clean", &first.name]).wait();
    first.assert_nothing_left();
}

#[test]
fn results_of_an_earlier_run_are_replaced_only_when_asked_for() {
    let case = Case::new("again", &[2; 2], PLAIN);
    let run = || Started::new(case.folder(), &["run", "deployment.toml"]).wait();
    assert_eq!(run().status.code(), Some(0));
    let before = fs::metadata(case.path("out/pose3d.jsonl")).unwrap();
    let ended = run().ends(3);
    let said = "pass --force to replace them";
    ended.says(said);
    let after = fs::metadata(case.path("out/pose3d.jsonl")).unwrap();
    assert_eq!(before.modified().unwrap(), after.modified().unwrap());
}

#[test]
fn a_camera_name_cannot_lead_outside_the_output_folder() {
    let case = Case::new("escape", &[2; 2], PLAIN);
    let name = "../../../../x_escape";
    case.edit(
        "deployment.toml",
        "name = \"b\"",
        &format!("name = {name:?}"),
    );
    case.run().ends(3);
    let rig = fs::read_to_string(case.path("rig.toml")).unwrap();
    case.write("rig.toml", rig.replace("\"b\"", &format!("{name:?}")));
    case.start(&["calib", "check", "rig.toml"])
        .wait()
        .ends(5)
        .says("do not contain /");
}
