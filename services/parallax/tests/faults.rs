//! Tests of runs with real processes in which one process is suspended, terminated or killed.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::collections::{BTreeSet, HashMap};
use std::fmt::Write as _;
use std::fs;

use common::started::signal;
use common::{Case, PACED};
use serde_json::{Value, json};

const N_FRAMES: u64 = 80;

/// Outcome of a run of three views in which one process received a signal after ten frames.
struct Signalled {
    lines: Vec<Value>,
    summary: Value,
    stderr: String,
}

impl Signalled {
    /// Runs to the end. Checks the exit code, the restart, and that nothing is left behind.
    ///
    /// * `name`: name of the signal.
    /// * `victim`: the process, as on its command line, for example `pose --index 1`.
    fn new(more: &str, name: &str, victim: &str) -> Self {
        let process = victim.replace(" --index ", "-");
        let case = Case::new(&process, &[N_FRAMES as usize; 3], more);
        case.write("q.csv", expected_errors());
        let mut started = case.start(&["run", "deployment.toml", "--json"]);
        started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
        signal(name, started.pid_of(victim).into());
        let ended = started.wait();
        case.assert_nothing_left();
        assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
        let report: Value = serde_json::from_str(&ended.stdout).unwrap();
        let restarts = json!([{ "process": process, "restarts": 1 }]);
        assert_eq!(report["restarts"], restarts, "{}", ended.stderr);
        Self {
            lines: case.lines("pose3d.jsonl"),
            summary: report["recorded"]["summary"].clone(),
            stderr: ended.stderr,
        }
    }

    fn frames(&self) -> Vec<u64> {
        let frames = self.lines.iter().map(|line| line["frame"].as_u64().unwrap());
        frames.collect()
    }

    fn assert_every_frame(&self) {
        let expected: Vec<u64> = (0..N_FRAMES).collect();
        assert_eq!(self.frames(), expected, "{}", self.stderr);
    }

    /// Checks that frames without a result have one of the expected reasons, are counted, and are fewer than `n`.
    fn assert_reasons(&self, expected: &[&str], n: usize) {
        let without = self.lines.iter().filter(|line| line["status"] == "no result");
        let reasons: Vec<&str> =
            without.map(|without| without["reason"].as_str().unwrap()).collect();
        assert!(reasons.len() < n, "{reasons:?}");
        let known = |reason: &&str| expected.contains(reason);
        assert!(reasons.iter().all(known), "{reasons:?}");
        assert_eq!(self.summary["frames_missed"], json!(reasons.len()));
        let counted = self.summary["frames"].as_u64().unwrap();
        assert_eq!(counted + reasons.len() as u64, self.lines.len() as u64);
    }

    /// For each frame that lacks a view, returns the views that are present.
    fn incomplete(&self) -> Vec<&Value> {
        let views = self.lines.iter().map(|line| &line["views_present"]);
        views.filter(|view| **view != json!(["a", "b", "c"])).collect()
    }
}

/// Returns a table of expected errors for the three views.
fn expected_errors() -> String {
    let model = common::planted::model();
    let parts = (0..model.n_parts()).map(|i| format!("part_{}", i + 1));
    let parts: Vec<String> = parts.collect();
    let mut table = format!("view,frame,{}\n", parts.join(","));
    for view in ["a", "b", "c"] {
        for frame in 0..N_FRAMES {
            let errors = vec!["3"; parts.len()].join(",");
            writeln!(table, "{view},{frame},{errors}").unwrap();
        }
    }
    table
}

/// Sends a process a signal that asks it to end. No more frames may be lost than after a crash.
fn terminate(name: &str, victim: &str) -> Signalled {
    let run = Signalled::new(PACED, name, victim);
    let number = HashMap::from([("TERM", 15), ("INT", 2), ("HUP", 1)])[name];
    let message = format!("ended by signal {number}");
    assert!(run.stderr.contains(&message), "{}", run.stderr);
    run.assert_every_frame();
    // The process continues for two seconds, and is then restarted as after a crash.
    run.assert_reasons(&["process lost", "recorder lost"], 40);
    run
}

#[test]
fn a_terminated_capture_process_is_restarted_and_continues_with_the_next_frame() {
    let run = terminate("TERM", "capture --index 1");
    assert_eq!(run.incomplete(), Vec::<&Value>::new());
}

#[test]
fn a_terminated_pose_process_is_restarted() {
    let run = terminate("HUP", "pose --index 1");
    assert!(run.incomplete().len() <= 2, "{}", run.stderr);
}

#[test]
fn a_terminated_quality_process_is_restarted() {
    let more = PACED.to_owned() + "errors = { table = \"q.csv\" }\n";
    let run = Signalled::new(&more, "INT", "quality --index 1");
    run.assert_every_frame();
    assert_eq!(run.incomplete(), Vec::<&Value>::new());
}

#[test]
fn a_terminated_fusion_worker_is_restarted() {
    let run = terminate("TERM", "fuse --index 0");
    assert_eq!(run.lines.last().unwrap()["people"][0]["pairs"], json!(3));
}

#[test]
fn a_terminated_triangulation_process_is_restarted() {
    terminate("INT", "triangulate");
}

#[test]
fn a_terminated_results_process_is_restarted() {
    terminate("HUP", "results");
}

#[test]
fn a_killed_capture_process_continues_with_the_next_frame() {
    let run = Signalled::new(PACED, "KILL", "capture --index 1");
    run.assert_every_frame();
    assert_eq!(run.incomplete(), Vec::<&Value>::new());
}

#[test]
fn moving_the_folder_away_does_not_end_the_run_when_a_process_is_killed() {
    let case = Case::new("moved", &[N_FRAMES as usize; 3], PACED);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    fs::rename(case.path("out"), case.path("gone")).unwrap();
    for victim in ["capture --index 1", "fuse --index 0"] {
        signal("KILL", started.pid_of(victim).into());
    }
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let restarts =
        json!([{ "process": "fuse-0", "restarts": 1 }, { "process": "capture-1", "restarts": 1 }]);
    assert_eq!(report["restarts"], restarts, "{}", ended.stderr);
    // The results process has its folder open, so it continues to write there after the move.
    let text = fs::read_to_string(case.path("gone/pose3d.jsonl")).unwrap();
    assert_eq!(text.lines().count() as u64, N_FRAMES, "{}", ended.stderr);
}

#[test]
fn a_killed_fusion_worker_loses_only_the_pairs_of_a_few_frames() {
    let run = Signalled::new(PACED, "KILL", "fuse --index 0");
    run.assert_every_frame();
    assert_eq!(run.incomplete(), Vec::<&Value>::new());
    // The other worker solves one of the three pairs.
    let pairs = run.lines.iter().map(|line| &line["people"][0]["pairs"]);
    let pairs: Vec<&Value> = pairs.collect();
    assert!(
        pairs.iter().all(|pairs| pairs.as_u64() > Some(0)),
        "{pairs:?}"
    );
    let n_without = pairs.iter().filter(|pair| ***pair != json!(3)).count();
    assert!(n_without < 20, "{pairs:?}");
    assert_eq!(pairs.last(), Some(&&json!(3)), "it is not back");
}

#[test]
fn a_killed_triangulation_process_loses_few_frames_and_they_are_counted() {
    let run = Signalled::new(PACED, "KILL", "triangulate");
    // Every frame has exactly one line, in order: a result, or the reason why it is missing.
    run.assert_every_frame();
    run.assert_reasons(&["process lost"], 20);
}

#[test]
fn every_frame_of_a_live_run_has_one_line_after_triangulation_is_killed() {
    let live = PACED.replace("\"paced\"", "\"realtime\"");
    let run = Signalled::new(&live, "KILL", "triangulate");
    let frames = run.frames();
    let expected: Vec<u64> = (0..frames.len() as u64).collect();
    assert_eq!(frames, expected, "{}", run.stderr);
    for it in run.lines.iter().filter(|line| line["status"] == "no result") {
        assert!(!it["reason"].as_str().unwrap().is_empty(), "{it}");
        assert_eq!(it["views_missing"].as_object().unwrap().len(), 3, "{it}");
    }
    let n_lines =
        run.summary["frames"].as_u64().unwrap() + run.summary["frames_missed"].as_u64().unwrap();
    assert_eq!(n_lines, frames.len() as u64);
}

#[test]
fn a_suspended_pose_process_is_detected_and_no_frame_is_lost() {
    let run = Signalled::new(PACED, "STOP", "pose --index 1");
    assert!(run.stderr.contains("sent no heartbeat"), "{}", run.stderr);
    run.assert_every_frame();
    // The view may be missing in at most two frames: the frame that the process was processing, and the next frame.
    let without = run.incomplete();
    assert!(without.len() <= 2, "{without:?}");
    assert!(
        without.iter().all(|views| **views == json!(["a", "c"])),
        "{without:?}"
    );
}

#[test]
fn a_live_run_continues_without_a_suspended_view_until_it_is_back() {
    let live = PACED.replace("\"paced\"", "\"realtime\"");
    // There is time for results without the view before the suspended process is restarted.
    let more = live + "[supervise]\nmissed_beats = 12\nmax_restarts = 9\n";
    let case = Case::new("pose-1", &[240; 3], &more);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    // Without its model, the process cannot restart before frames are lost. How long this takes depends on the machine.
    fs::rename(case.path("model.plx"), case.path("away.plx")).unwrap();
    signal("STOP", started.pid_of("pose --index 1").into());
    started.until("lost frames", |_| {
        let lines = case.lines("pose3d.jsonl");
        lines.iter().any(|line| line["views_missing"]["b"] == "process lost")
    });
    fs::rename(case.path("away.plx"), case.path("model.plx")).unwrap();
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let [restarted] = report["restarts"].as_array().unwrap().as_slice() else {
        panic!("{}", ended.stderr);
    };
    assert_eq!(restarted["process"], "pose-1", "{}", ended.stderr);
    assert_back_after_a_gap(&case.lines("pose3d.jsonl"));
}

/// Checks that view `b` was first late, was then lost with its process, and was used again afterwards.
fn assert_back_after_a_gap(lines: &[Value]) {
    let n_without_b = lines.iter().filter(|line| line["views_present"] == json!(["a", "c"]));
    assert!(n_without_b.count() > 3, "{lines:?}");
    let reasons: BTreeSet<&str> =
        lines.iter().filter_map(|line| line["views_missing"]["b"].as_str()).collect();
    for reason in ["late", "process lost"] {
        assert!(reasons.contains(reason), "{reasons:?}");
    }
    let last = |holds: fn(&Value) -> bool| lines.iter().rposition(holds);
    let lost = last(|value| value["views_missing"]["b"] == "process lost");
    let there = last(|value| value["views_missing"]["b"].is_null());
    assert!(there > lost, "it is not back: {lines:?}");
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes long"]
    fn a_process_whose_model_is_missing_at_its_restart_is_given_up_and_the_run_continues() {
        let more = PACED.to_owned() + "[supervise]\nmax_restarts = 2\n";
        let case = Case::new("no-model", &[N_FRAMES as usize; 3], &more);
        let mut started = case.start(&["run", "deployment.toml", "--json"]);
        started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
        fs::remove_file(case.path("model.plx")).unwrap();
        signal("KILL", started.pid_of("pose --index 1").into());
        let ended = started.wait();
        case.assert_nothing_left();
        assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
        let report: Value = serde_json::from_str(&ended.stdout).unwrap();
        assert_eq!(report["given_up"], json!(["pose-1"]), "{}", ended.stderr);
        ended.says("model.plx");
        let last = case.lines("pose3d.jsonl").pop().unwrap();
        assert_eq!(
            last["frame"],
            json!(N_FRAMES - 1),
            "{}\n{report:#}",
            ended.stderr
        );
        assert_eq!(last["views_present"], json!(["a", "c"]));
    }
}
