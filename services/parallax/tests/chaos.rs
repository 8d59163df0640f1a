//! Chaos on a short deployment: real processes, real kills, the verdicts and the exit codes.

mod common;

use std::fs;

use common::{Case, Ended, PACED};
use serde_json::{Value, json};

/// Two seconds of results are enough; a machine that is busy may take its time.
const PATIENT: [&str; 4] = ["--max-return-ms", "60000", "--max-pause-ms", "60000"];

/// Tries scenarios on a planted deployment; how that ended, and `chaos.json`.
fn chaos(case: &Case, scenarios: &str, more: &[&str]) -> (Ended, Value) {
    let plain = [
        "chaos",
        "deployment.toml",
        "--scenario",
        scenarios,
        "--out",
        "chaos",
        "--name",
        &case.name,
        "--json",
    ];
    let ended = case.start(&[&plain[..], more].concat()).wait();
    case.assert_nothing_left();
    let report = fs::read_to_string(case.path("chaos/chaos.json")).unwrap_or_default();
    let report = serde_json::from_str(&report).unwrap_or(Value::Null);
    (ended, report)
}

#[test]
fn a_killed_view_comes_back_and_after_a_killed_supervisor_the_next_run_works() {
    let case = Case::new("chaos", &[80; 3], PACED);
    let (ended, report) = chaos(&case, "kill-pose,kill-supervisor", &PATIENT);
    assert_eq!(ended.status.code(), Some(0), "{}\n{report:#}", ended.stderr);
    let printed: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(printed, report, "the same on standard output");

    let [pose, supervisor] = &report["scenarios"].as_array().unwrap()[..] else {
        panic!("{report:#}")
    };
    assert_eq!(pose["scenario"], "kill-pose");
    let process = &pose["measured"]["process"];
    assert!(process.as_str().unwrap().starts_with("pose-"), "{process}");
    let restarts = json!([{ "process": process, "restarts": 1 }]);
    assert_eq!(pose["run"]["restarts"], restarts);
    let cost = &pose["measured"]["cost"];
    let ms = |key: &str| cost[key].as_f64().unwrap();
    assert!(ms("noticed_ms") < ms("restarted_ms"), "{cost:#}");
    assert!(ms("restarted_ms") < ms("back_ms"), "{cost:#}");
    assert!(ms("longest_pause_ms") > 0.0, "{cost:#}");

    let measured = &supervisor["measured"];
    assert!(measured["files_left"].as_u64() > Some(10), "{measured:#}");
    assert!(measured["children_ended_ms"].is_number(), "{measured:#}");
    assert_eq!(
        supervisor["run"]["restarts"],
        json!([]),
        "nobody was struck"
    );
    assert_eq!(
        case.lines("pose3d.jsonl").len(),
        0,
        "not into its own folder"
    );
}

#[test]
fn what_did_not_hold_is_named_and_has_an_exit_code_of_its_own() {
    let case = Case::new("chaos-missed", &[40; 2], PACED);
    let (ended, report) = chaos(&case, "kill-fuse", &["--max-return-ms", "0"]);
    assert_eq!(ended.status.code(), Some(6), "{}\n{report:#}", ended.stderr);
    assert_eq!(report["held"], false);
    let limits = report["scenarios"][0]["limits"].as_array().unwrap();
    let back = limits.iter().find(|it| it["what"] == "back after, ms");
    assert_eq!(back.unwrap()["held"], false, "{report:#}");
}

#[test]
fn scenarios_are_listed_and_those_that_cannot_be_are_refused() {
    let case = Case::new("chaos-list", &[2; 2], PACED);
    let ended = case.start(&["chaos", "--list"]).wait();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    for name in [
        "kill-capture",
        "hang-fuse",
        "kill-random",
        "kill-supervisor",
    ] {
        assert!(ended.stdout.contains(name), "{name}: {}", ended.stdout);
    }
    let (ended, _) = chaos(&case, "kill-quality", &[]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("no such process"), "{}", ended.stderr);
    let (ended, _) = chaos(&case, "kill-nobody", &[]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("--list"), "{}", ended.stderr);
}
