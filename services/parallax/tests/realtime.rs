//! Runs in which the latest frame wins: what is too slow loses frames, and every one is counted.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use common::started::signal;
use common::{Case, Ended};
use serde_json::{Value, json};

const LIVE: &str = "[results]\noverlay_every = 0\n[fuse]\nworkers = 2\n\
                    [capture]\nupright = false\nmode = \"realtime\"\n";
const PACED: &str = "pace = \"realtime\"\nframe_rate_hz = 20\n";

/// What became of a run.
struct Told {
    report: Value,
    lines: Vec<Value>,
}

impl Told {
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
            let is_in = |it: &&Value| {
                let present = it["views_present"].as_array().unwrap();
                assert_ne!(
                    present.contains(&view["name"]),
                    it["views_missing"]
                        .get(view["name"].as_str().unwrap())
                        .is_some(),
                    "present, or missing for a reason: {it}"
                );
                present.contains(&view["name"])
            };
            let n_lines = lines.iter().filter(is_in).count();
            assert_eq!(count("used"), n_lines as u64, "{view}");
        }
        Self { report, lines }
    }

    /// A count of one view.
    fn view(&self, view: usize, key: &str) -> u64 {
        self.report["views"][view][key].as_u64().unwrap()
    }
}

#[test]
fn who_keeps_up_loses_nothing() {
    let unhurried = PACED.replace("= 20", "= 8");
    let case = Case::new("live", &[16; 2], &format!("{LIVE}{unhurried}"));
    let ended = case.run();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let told = Told::new(&case, &ended);
    // A loaded machine may be late for some.
    assert!(told.view(0, "used") > 8, "{:#}", told.report["views"]);
}

#[test]
fn who_is_too_slow_answers_fewer_frames_and_every_one_is_counted() {
    // More frames a second than any machine answers. That slow views take the same ones is a law of
    // `join::Cadence`, tested there; how soon they get to it is a matter of the machine's load.
    let hurried = PACED.replace("= 20", "= 200");
    let more = format!("{LIVE}{hurried}size = [240, 320]\n");
    let case = Case::new("slow", &[300; 3], &more);
    let ended = case.run();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let told = Told::new(&case, &ended);
    for view in 0..3 {
        assert!(told.view(view, "dropped") > 5, "{:#}", told.report["views"]);
    }
    assert!(!told.lines.is_empty(), "{:#}", told.report["views"]);
}

#[test]
fn footage_that_nobody_paces_is_over_at_once_and_what_was_left_out_is_counted() {
    let case = Case::new("unpaced", &[60; 2], LIVE);
    let ended = case.run();
    let told = Told::new(&case, &ended);
    // Where the same frame of both views was never in time nothing is placed in space, and that is said.
    let is_empty = told.report["recorded"]["summary"]["frames_with_pose"] == 0;
    let expected = if is_empty { 7 } else { 0 };
    assert_eq!(ended.status.code(), Some(expected), "{:#}", told.report);
    assert_eq!(told.report["no_results"].is_string(), is_empty);
    for view in 0..2 {
        assert!(told.view(view, "dropped") > 0, "{:#}", told.report["views"]);
        assert_eq!(told.view(view, "unanswered"), 0);
    }
}

#[test]
fn a_slow_consumer_does_not_slow_its_producer() {
    let patient = "[supervise]\nmissed_beats = 1000\nhang_limit_s = 120\n";
    let case = Case::new("pause", &[80; 2], &format!("{LIVE}{PACED}{patient}"));
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    let pid = started.pid_of("pose --index 1");
    signal("STOP", pid.into());
    let n = case.lines("pose3d.jsonl").len();
    // The other view goes on in the meantime.
    started.until("ten more", |_| case.lines("pose3d.jsonl").len() >= n + 10);
    signal("CONT", pid.into());
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let told = Told::new(&case, &ended);
    // But for those that a loaded machine was late for, its camera sent all.
    let unsent = &told.report["recorded"]["summary"]["frames_dropped_by_capture"];
    let unsent = unsent.as_u64().unwrap();
    assert!(2 * unsent < told.view(1, "dropped"), "{:#}", told.report);
    assert!(told.view(1, "dropped") >= 5, "{:#}", told.report["views"]);
    let missing = &told.report["recorded"]["summary"]["views_missing"]["b"];
    assert!(missing["late"].as_u64() > Some(0), "{missing}");
}

#[test]
fn a_process_that_computes_for_ever_is_found_out_by_the_work_of_its_frames() {
    // The clock alone would leave it alone for ten minutes.
    let patient = "[supervise]\nhang_limit_s = 600\n";
    let case = Case::new("spins", &[160; 2], &format!("{LIVE}{PACED}{patient}"));
    let spins = "name = \"b\"\nfault = \"spin@60+1\"";
    case.edit("deployment.toml", "name = \"b\"", spins);
    let ended = case.run();
    let told = Told::new(&case, &ended);
    let restarts = json!([{ "process": "capture-1", "restarts": 1 }]);
    assert_eq!(told.report["restarts"], restarts, "{}", ended.stderr);
    let last = told.lines.last().unwrap();
    assert_eq!(last["views_present"], json!(["a", "b"]), "it is not back");
}
