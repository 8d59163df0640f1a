//! Tests of the demo as a new user starts it, but shorter: real processes, a real kill, the report.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::fs;
use std::sync::{Mutex, PoisonError};

use common::{Case, Ended};
use serde_json::{Value, json};

/// Two demos at the same time would compete for cores.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Runs a short demo in its own folder. Returns the folder, the exit and `report.json`.
fn demo(name: &str, more: &[&str]) -> (Case, Ended, Value) {
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let case = Case::new(name, &[1, 1], "");
    let plain = ["demo", "--out", "demo", "--name", &case.name, "--json"];
    let ended = case.start(&[&plain, more].concat()).wait();
    case.assert_nothing_left();
    let report = fs::read_to_string(case.path("demo/report.json")).unwrap_or_default();
    let report = serde_json::from_str(&report).unwrap_or(Value::Null);
    (case, ended, report)
}

/// Returns the limits that were exceeded.
fn missed(report: &Value) -> Vec<&str> {
    let limits = report["limits"].as_array().unwrap();
    let missed = limits.iter().filter(|limit| limit["held"] == false);
    missed.map(|missed| missed["what"].as_str().unwrap()).collect()
}

#[test]
fn a_killed_camera_is_restarted_and_the_report_counts_the_lost_frames() {
    // The demo is slow enough for a loaded machine, and the limits allow for dropped frames.
    let limits = "--min-results 5 --min-skeletons 10 --min-pcp3d 5";
    let at = |rate_hz: f64| {
        let [deadline_ms, return_ms, pause_ms] =
            [8.0, 24.0, 16.0].map(|frames| 1000.0 * frames / rate_hz);
        let times = format!(
            "--deadline-ms {deadline_ms} --max-return-ms {return_ms} --max-pause-ms {pause_ms}"
        );
        let options = format!("--frames 20 --rate {rate_hz} {times} {limits}");
        demo("demo", &options.split(' ').collect::<Vec<_>>())
    };
    let mut rate_hz = 0.8;
    let (mut case, mut ended, mut report) = at(rate_hz);
    if ended.status.code() == Some(6) {
        rate_hz = 0.2;
        (case, ended, report) = at(rate_hz);
    }
    assert_eq!(ended.status.code(), Some(0), "{}\n{report:#}", ended.stderr);
    assert_eq!(missed(&report), Vec::<&str>::new());
    let printed: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(
        printed, report,
        "the same on standard output and in the file"
    );

    assert_eq!(
        report["machine"],
        Value::Null,
        "a given rate needs no measurement"
    );
    assert_eq!(report["frame_rate_hz"], rate_hz);
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let killed = &report["killed"];
    assert_eq!(report["killed_camera"], "c3");
    assert!(
        number(&killed["back_ms"]) > number(&killed["restarted_ms"]),
        "{killed:#}"
    );
    assert!(
        killed["first_frame"].as_u64() > killed["last_frame"].as_u64(),
        "{killed:#}"
    );
    assert!(number(&killed["longest_pause_ms"]) > 0.0, "{killed:#}");
    let restarts = json!([{ "process": "capture-2", "restarts": 1 }]);
    assert_eq!(report["run"]["restarts"], restarts);
    let accuracy = &report["accuracy"]["all"];
    let [pcp3d, mpjpe] = ["pcp3d_percent", "mpjpe_mm"].map(|key| number(&accuracy[key]));
    // Only frames with a skeleton are counted, because their number depends on the machine.
    let found = 1.0 - number(&accuracy["lost_percent"]) / 100.0;
    assert!((35.0..=100.0).contains(&(pcp3d / found)), "{accuracy:#}");
    assert!((5.0..400.0).contains(&mpjpe), "{accuracy:#}");
    for view in report["run"]["views"].as_array().unwrap() {
        let parts = ["used", "empty", "late", "dropped", "lost", "unanswered"];
        let sum: u64 = parts.iter().map(|part| view[part].as_u64().unwrap()).sum();
        assert_eq!(sum, 20, "{view:#}");
    }

    let page = fs::read_to_string(case.path("demo/report.html")).unwrap();
    for words in ["All 9 limits held", "killed", "data:image/jpeg;base64,"] {
        assert!(page.contains(words), "{words}");
    }
    assert!(page.len() < 4_000_000, "{} bytes", page.len());
    counts_are_those_of_the_results(&case, &report, &page);
    a_killed_camera_was_lost_and_not_late(&case, killed);
}

/// Returns the lines of a results file of the demo.
fn lines(case: &Case, name: &str) -> Vec<Value> {
    let text = fs::read_to_string(case.path("demo/run").join(name)).unwrap();
    let lines = text.lines().map(serde_json::from_str);
    lines.map(Result::unwrap).collect()
}

fn counts_are_those_of_the_results(case: &Case, report: &Value, page: &str) {
    let is_found = |joint: &Value| joint["position_m"].is_array();
    let has_joints = |person: &Value| {
        let joints = person["joints"].as_object();
        joints.is_some_and(|joints| joints.values().any(is_found))
    };
    let is_posed =
        |value: &&Value| value["people"].as_array().is_some_and(|all| all.iter().any(has_joints));
    let is_whole = |value: &&Value| value["views_missing"] == json!({});
    let poses = lines(case, "pose3d.jsonl");
    let posed = poses.iter().filter(is_posed);
    let whole = posed.clone().filter(is_whole).count();
    let (posed, results) = (posed.count(), &report["frames_with_result"]);
    assert_eq!(report["frames_with_skeleton"], json!(posed));
    let said = format!(
        "result{}: {posed} with a skeleton in space, {whole} of these from all 4 cameras",
        if *results == 1 { "" } else { "s" }
    );
    assert!(
        page.contains(&format!("produced {results} {said}")),
        "{said}: {page:.4000}"
    );
}

fn a_killed_camera_was_lost_and_not_late(case: &Case, killed: &Value) {
    let number = |key: &str| killed[key].as_f64().unwrap();
    let [last, first] = [number("last_frame"), number("first_frame")];
    let restarted_ms = number("killed_at_ms") + number("restarted_ms");
    let times = lines(case, "times.jsonl");
    for it in lines(case, "pose3d.jsonl") {
        let frame = it["frame"].as_f64().unwrap();
        let sent = times.iter().find(|time| time["frame"] == it["frame"]);
        let sent_ms = sent.and_then(|sent| sent["sent_ms"].as_f64()).unwrap_or(0.0);
        if last < frame && frame < first && sent_ms > restarted_ms {
            assert_eq!(
                it["views_missing"]["c3"], "process lost",
                "frame {frame}: {it}"
            );
        }
    }
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes long"]
    fn a_missed_limit_of_the_demo_is_named_and_has_its_own_exit_code() {
        let impossible = ["--frames", "12", "--no-kill", "--min-pcp3d", "101"];
        let (case, ended, report) = demo("demo-missed", &impossible);
        assert_eq!(ended.status.code(), Some(6), "{}\n{report:#}", ended.stderr);
        assert!(missed(&report).contains(&"PCP3D at 0.5, %"), "{report:#}");
        assert_eq!(
            (&report["held"], &report["killed"]),
            (&json!(false), &Value::Null)
        );
        assert_eq!(
            report["run"]["restarts"],
            json!([]),
            "no process was killed"
        );
        // The machine is measured before and after the run. The slower result is reported, with the resulting frame rate.
        let machine = &report["machine"];
        let [frame_ms, rate_hz, slowness] =
            ["frame_ms", "rate_hz", "slowness"].map(|key| machine[key].as_f64().unwrap());
        let cameras_hz = report["frame_rate_hz"].as_f64().unwrap();
        assert!(frame_ms > 0.0 && slowness >= 1.0, "{machine:#}");
        assert!((rate_hz..=5.0).contains(&cameras_hz), "{machine:#}");
        ended.says("a frame of 4 cameras takes");
        let page = fs::read_to_string(case.path("demo/report.html")).unwrap();
        assert!(page.contains("limits missed"));
    }
}
