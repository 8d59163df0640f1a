//! What is left of a run of real processes when one of them is stopped or killed.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::collections::{BTreeSet, HashMap};
use std::fmt::Write as _;
use std::fs;

use common::started::signal;
use common::{Case, PACED};
use serde_json::{Value, json};

const N_FRAMES: u64 = 80;

/// What became of a run of three views one process of which got a signal after ten frames.
struct Struck {
    lines: Vec<Value>,
    summary: Value,
    said: String,
}

impl Struck {
    /// It is over, it says that it lost something, and nothing of it is left.
    ///
    /// * `victim`: as on its command line, for example `pose --index 1`.
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
            said: ended.stderr,
        }
    }

    fn frames(&self) -> Vec<u64> {
        let frames = self.lines.iter().map(|it| it["frame"].as_u64().unwrap());
        frames.collect()
    }

    fn assert_every_frame(&self) {
        let expected: Vec<u64> = (0..N_FRAMES).collect();
        assert_eq!(self.frames(), expected, "{}", self.said);
    }

    /// Frames without a result say why, are few, and are counted.
    ///
    /// * `n`: there are fewer of them.
    fn assert_reasons(&self, expected: &[&str], n: usize) {
        let without = self.lines.iter().filter(|it| it["status"] == "no result");
        let reasons: Vec<&str> = without.map(|it| it["reason"].as_str().unwrap()).collect();
        assert!(reasons.len() < n, "{reasons:?}");
        let known = |it: &&str| expected.contains(it);
        assert!(reasons.iter().all(known), "{reasons:?}");
        assert_eq!(self.summary["frames_missed"], json!(reasons.len()));
        let counted = self.summary["frames"].as_u64().unwrap();
        assert_eq!(counted + reasons.len() as u64, self.lines.len() as u64);
    }

    /// The views of the frames that do not have all of them.
    fn without_all(&self) -> Vec<&Value> {
        let views = self.lines.iter().map(|it| &it["views_present"]);
        views.filter(|it| **it != json!(["a", "b", "c"])).collect()
    }
}

/// A table of expected errors of the three views.
fn expected_errors() -> String {
    let model = common::planted::model();
    let parts = (0..model.n_parts()).map(|it| format!("part_{}", it + 1));
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

/// What a plain `kill` of a process leaves: no more than a crash.
fn told_to_end(name: &str, victim: &str) -> Struck {
    let struck = Struck::new(PACED, name, victim);
    let number = HashMap::from([("TERM", 15), ("INT", 2), ("HUP", 1)])[name];
    let said = format!("ended by signal {number}");
    assert!(struck.said.contains(&said), "{}", struck.said);
    struck.assert_every_frame();
    // It goes on for two seconds, then comes back as after a crash.
    struck.assert_reasons(&["process lost", "recorder lost"], 40);
    struck
}

#[test]
fn a_camera_that_is_told_to_end_comes_back_and_goes_on_where_it_was() {
    let struck = told_to_end("TERM", "capture --index 1");
    assert_eq!(struck.without_all(), Vec::<&Value>::new());
}

#[test]
fn a_pose_process_that_is_told_to_end_comes_back() {
    let struck = told_to_end("HUP", "pose --index 1");
    assert!(struck.without_all().len() <= 2, "{}", struck.said);
}

#[test]
fn a_quality_process_that_is_told_to_end_comes_back() {
    let more = PACED.to_owned() + "[quality]\ntable = \"q.csv\"\n";
    let struck = Struck::new(&more, "INT", "quality --index 1");
    struck.assert_every_frame();
    assert_eq!(struck.without_all(), Vec::<&Value>::new());
}

#[test]
fn a_fusion_worker_that_is_told_to_end_comes_back() {
    let struck = told_to_end("TERM", "fuse --index 0");
    assert_eq!(struck.lines.last().unwrap()["pairs"], json!(3));
}

#[test]
fn a_triangulation_that_is_told_to_end_comes_back() {
    told_to_end("INT", "triangulate");
}

#[test]
fn a_recorder_that_is_told_to_end_comes_back() {
    told_to_end("HUP", "results");
}

#[test]
fn a_killed_camera_goes_on_where_it_was() {
    let struck = Struck::new(PACED, "KILL", "capture --index 1");
    struck.assert_every_frame();
    assert_eq!(struck.without_all(), Vec::<&Value>::new());
}

#[test]
fn a_folder_that_is_moved_away_does_not_end_the_run_when_a_process_is_killed() {
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
    // The recorder has its files open, wherever they are by now.
    let text = fs::read_to_string(case.path("gone/pose3d.jsonl.part")).unwrap();
    assert_eq!(text.lines().count() as u64, N_FRAMES, "{}", ended.stderr);
    assert!(
        ended.stderr.contains("rename the finished"),
        "{}",
        ended.stderr
    );
}

#[test]
fn a_model_that_is_gone_when_a_process_comes_back_costs_that_process_alone() {
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
    assert!(ended.stderr.contains("model.plx"), "{}", ended.stderr);
    let last = case.lines("pose3d.jsonl").pop().unwrap();
    assert_eq!(last["frame"], json!(N_FRAMES - 1));
    assert_eq!(last["views_present"], json!(["a", "c"]));
}

#[test]
fn a_killed_fusion_worker_costs_its_pairs_of_a_few_frames() {
    let struck = Struck::new(PACED, "KILL", "fuse --index 0");
    struck.assert_every_frame();
    assert_eq!(struck.without_all(), Vec::<&Value>::new());
    // The other worker has one pair of the three.
    let pairs: Vec<_> = struck.lines.iter().map(|it| &it["pairs"]).collect();
    assert!(pairs.iter().all(|it| **it != json!(0)), "{pairs:?}");
    let n_without = pairs.iter().filter(|it| ***it != json!(3)).count();
    assert!(n_without < 20, "{pairs:?}");
    assert_eq!(pairs.last(), Some(&&json!(3)), "it is not back");
}

#[test]
fn a_killed_triangulation_costs_the_frames_it_held_and_they_are_counted() {
    let struck = Struck::new(PACED, "KILL", "triangulate");
    // A line of every frame, in order and none twice: a result, or why there is none.
    struck.assert_every_frame();
    struck.assert_reasons(&["process lost"], 20);
}

#[test]
fn every_frame_of_a_live_run_has_one_line_though_triangulation_was_killed() {
    let live = PACED.replace("pace =", "mode = \"realtime\"\npace =");
    let struck = Struck::new(&live, "KILL", "triangulate");
    let frames = struck.frames();
    let expected: Vec<u64> = (0..frames.len() as u64).collect();
    assert_eq!(frames, expected, "{}", struck.said);
    for it in struck.lines.iter().filter(|it| it["status"] == "no result") {
        assert!(!it["reason"].as_str().unwrap().is_empty(), "{it}");
        assert_eq!(it["views_missing"].as_object().unwrap().len(), 3, "{it}");
    }
    let n_lines = struck.summary["frames"].as_u64().unwrap()
        + struck.summary["frames_missed"].as_u64().unwrap();
    assert_eq!(n_lines, frames.len() as u64);
}

#[test]
fn a_stopped_view_is_found_out_and_no_frame_is_lost() {
    let struck = Struck::new(PACED, "STOP", "pose --index 1");
    assert!(struck.said.contains("sent no heartbeat"), "{}", struck.said);
    struck.assert_every_frame();
    // All that it may cost is the frame that it held, and the one that waited for it.
    let without = struck.without_all();
    assert!(without.len() <= 2, "{without:?}");
    assert!(
        without.iter().all(|it| **it == json!(["a", "c"])),
        "{without:?}"
    );
}

#[test]
fn a_live_run_goes_on_without_a_stopped_view_until_it_is_back() {
    let live = PACED.replace("pace =", "mode = \"realtime\"\npace =");
    // Long enough for results without it while it merely stands still.
    let more = live + "[supervise]\nmissed_beats = 12\nmax_restarts = 9\n";
    let case = Case::new("pose-1", &[240; 3], &more);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    // Its next life cannot begin before frames are lost with the first: how long that takes is the machine's matter.
    fs::rename(case.path("model.plx"), case.path("away.plx")).unwrap();
    signal("STOP", started.pid_of("pose --index 1").into());
    started.until("lost frames", |_| {
        let lines = case.lines("pose3d.jsonl");
        lines
            .iter()
            .any(|it| it["views_missing"]["b"] == "process lost")
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

/// View `b` was late, then lost with its process, and is back.
fn assert_back_after_a_gap(lines: &[Value]) {
    let n_without_b = lines
        .iter()
        .filter(|it| it["views_present"] == json!(["a", "c"]));
    assert!(n_without_b.count() > 3, "{lines:?}");
    let reasons: BTreeSet<&str> = lines
        .iter()
        .filter_map(|it| it["views_missing"]["b"].as_str())
        .collect();
    for reason in ["late", "process lost"] {
        assert!(reasons.contains(reason), "{reasons:?}");
    }
    let last = |holds: fn(&Value) -> bool| lines.iter().rposition(holds);
    let lost = last(|it| it["views_missing"]["b"] == "process lost");
    let there = last(|it| it["views_missing"]["b"].is_null());
    assert!(there > lost, "it is not back: {lines:?}");
}
