//! Tests of runs with realtime delivery: slow stages drop frames, and every dropped frame is counted.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use common::started::signal;
use common::{Case, Ended, last_taken};
use serde_json::{Value, json};

const LIVE: &str = "[results]\noverlay_every = 0\n[paper]\nworkers = 2\n\
                    [capture]\nupright = false\nmode = \"realtime\"\n";
const PACED: &str = "frame_rate_hz = 20\n";

/// The report and the results of a run.
struct Finished {
    report: Value,
    lines: Vec<Value>,
}

impl Finished {
    /// Checks that every frame of every view is accounted for, and that the results agree.
    fn new(case: &Case, ended: &Ended) -> Self {
        let report: Value = serde_json::from_str(&ended.stdout).unwrap();
        let lines = case.lines("pose3d.jsonl");
        for view in report["views"].as_array().unwrap() {
            let count = |key: &str| view[key].as_u64().unwrap();
            let kinds = ["used", "empty", "late", "dropped", "lost", "unanswered"];
            assert_eq!(
                kinds.map(count).iter().sum::<u64>(),
                count("frames"),
                "{view}"
            );
            let is_in = |value: &&Value| {
                let present = value["views_present"].as_array().unwrap();
                assert_ne!(
                    present.contains(&view["name"]),
                    value["views_missing"].get(view["name"].as_str().unwrap()).is_some(),
                    "present, or missing for a reason: {value}"
                );
                present.contains(&view["name"])
            };
            let n_lines = lines.iter().filter(is_in).count();
            assert_eq!(count("used"), n_lines as u64, "{view}");
        }
        Self { report, lines }
    }

    /// Returns a count of one view.
    fn view(&self, view: usize, key: &str) -> u64 {
        self.report["views"][view][key].as_u64().unwrap()
    }
}

#[test]
fn fast_stages_lose_no_frames() {
    let unhurried = PACED.replace("= 20", "= 8");
    let case = Case::new("live", &[16; 2], &format!("{LIVE}{unhurried}"));
    let ended = case.run().ends(0);
    let run = Finished::new(&case, &ended);
    // On a loaded machine some frames may be late.
    assert!(run.view(0, "used") > 8, "{:#}", run.report["views"]);
}

#[test]
fn slow_stages_process_fewer_frames_and_every_dropped_one_is_counted() {
    // The footage has more frames per second than any machine can process. The tests of `stage::join::Cadence` check that slow views choose
    // the same frames. How soon they do so depends on the load of the machine.
    let hurried = PACED.replace("= 20", "= 200");
    let more = format!("{LIVE}{hurried}size = [240, 320]\n");
    let case = Case::new("slow", &[300; 3], &more);
    let ended = case.run().ends(0);
    let run = Finished::new(&case, &ended);
    for view in 0..3 {
        assert!(run.view(view, "dropped") > 5, "{:#}", run.report["views"]);
    }
    assert!(!run.lines.is_empty(), "{:#}", run.report["views"]);
}

#[test]
fn footage_without_a_frame_rate_is_read_at_once_and_dropped_frames_are_counted() {
    let case = Case::new("unpaced", &[60; 2], LIVE);
    let ended = case.run();
    let run = Finished::new(&case, &ended);
    // If there was never a frame of both views in time, there is no 3D pose, and the report states this.
    let is_empty = run.report["recorded"]["summary"]["frames_with_pose"] == 0;
    let expected = if is_empty { 7 } else { 0 };
    assert_eq!(ended.status.code(), Some(expected), "{:#}", run.report);
    assert_eq!(run.report["no_results"].is_string(), is_empty);
    for view in 0..2 {
        assert!(run.view(view, "dropped") > 0, "{:#}", run.report["views"]);
        assert_eq!(run.view(view, "unanswered"), 0);
    }
}

#[test]
fn a_slow_receiver_does_not_slow_its_sender() {
    let patient = "[supervise]\nmissed_beats = 1000\nhang_limit_s = 120\n";
    let case = Case::new("pause", &[80; 2], &format!("{LIVE}{PACED}{patient}"));
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    let pid = started.pid_of("pose --index 1");
    signal("STOP", pid.into());
    let n = case.lines("pose3d.jsonl").len();
    // The other view continues meanwhile.
    started.until("ten more", |_| case.lines("pose3d.jsonl").len() >= n + 10);
    signal("CONT", pid.into());
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let run = Finished::new(&case, &ended);
    // The camera sent all frames, except those dropped on a loaded machine.
    let unsent = &run.report["recorded"]["summary"]["frames_dropped_by_capture"];
    let unsent = unsent.as_u64().unwrap();
    assert!(2 * unsent < run.view(1, "dropped"), "{:#}", run.report);
    assert!(run.view(1, "dropped") >= 5, "{:#}", run.report["views"]);
    let missing = &run.report["recorded"]["summary"]["views_missing"]["b"];
    assert!(missing["late"].as_u64() > Some(0), "{missing}");
}

#[test]
fn a_process_in_an_endless_computation_is_detected_by_its_missing_progress() {
    // The time limit alone would only detect the hang after ten minutes.
    let patient = "[supervise]\nhang_limit_s = 600\n";
    let case = Case::new("spins", &[160; 2], &format!("{LIVE}{PACED}{patient}"));
    let spins = "name = \"b\"\nfault = \"spin@60+1\"";
    case.edit("deployment.toml", "name = \"b\"", spins);
    let ended = case.run();
    let run = Finished::new(&case, &ended);
    let restarts = json!([{ "process": "capture-1", "restarts": 1 }]);
    assert_eq!(run.report["restarts"], restarts, "{}", ended.stderr);
    let last = last_taken(&run.lines);
    assert_eq!(last["views_present"], json!(["a", "b"]), "it is not back");
}
