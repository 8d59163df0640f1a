//! Tests of `status` and `top` with a running deployment, and of runs with a latency budget.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use common::started::signal;
use common::{Case, Ended, PACED, PLAIN};
use serde_json::Value;

const PROCESSES: [&str; 7] = [
    "capture-0",
    "capture-1",
    "pose-0",
    "pose-1",
    "fuse-0",
    "triangulate",
    "results",
];

/// Returns the processes of a running case from `status`.
fn processes(case: &Case) -> Vec<Value> {
    let ended = case.start(&["status", &case.name, "--json"]);
    let ended = ended.wait_among_others().ends(0);
    let told: Value = serde_json::from_str(&ended.stdout).unwrap();
    told["deployment"]["processes"].as_array().unwrap().clone()
}

/// Returns the times of one stage of a process, for one view or for all.
fn times<'a>(process: &'a Value, stage: &str, view: Option<u64>) -> Option<&'a Value> {
    let times = process["measured"]["times"].as_array().unwrap();
    let is_meant = |value: &&Value| value["stage"] == stage && value["view"].as_u64() == view;
    times.iter().find(is_meant)
}

/// Checks a process that has been running for a while.
fn assert_plausible(it: &Value) {
    assert_eq!(it["state"], "runs", "{it:#}");
    assert!(it["pid"].as_u64() > Some(1), "{it:#}");
    let measured = &it["measured"];
    assert_eq!(measured["restarts"], 0);
    assert!(
        measured["memory_bytes"].as_u64() > Some(1_000_000),
        "{it:#}"
    );
    let number = |key: &str| measured[key].as_f64().unwrap();
    // There are 20 pictures per second. A loaded machine is behind and then catches up, so the last period may have no pictures.
    assert!(number("sent") / number("seconds") > 0.01, "{it:#}");
    assert!(number("sent_per_second") < 200.0, "{it:#}");
    for it in measured["times"].as_array().unwrap() {
        let ms = ["p50_ms", "p99_ms", "p99_9_ms", "max_ms"].map(|key| it[key].as_f64().unwrap());
        assert!(ms.is_sorted() && ms[0] > 0.0 && ms[3] < 600e3, "{it:#}");
    }
}

#[test]
fn every_process_and_view_of_a_run_is_shown_with_rates_and_times() {
    let case = Case::new("shown", &[600; 2], PACED);
    let mut started = case.start(&["run", "deployment.toml"]);
    started.until("three frames", |_| case.lines("pose3d.jsonl").len() >= 3);

    let shown = processes(&case);
    let names: Vec<&str> = shown.iter().map(|shown| shown["process"].as_str().unwrap()).collect();
    assert_eq!(names, PROCESSES);
    shown.iter().for_each(assert_plausible);
    for (view, name) in [(0, "a"), (1, "b")] {
        for of in [view, 2 + view] {
            assert_eq!(shown[of]["measured"]["view"]["name"], name);
            assert!(times(&shown[of], "computing", None).is_some());
            assert!(times(&shown[of], "publishing", None).is_some());
        }
        let bytes = &shown[2 + view]["measured"]["evidence_bytes"];
        assert!(bytes.as_u64() > Some(10_000), "{bytes}");
        let view = Some(view as u64);
        assert!(
            times(&shown[4], "waiting", view).is_some(),
            "{:#}",
            shown[4]
        );
        assert!(times(&shown[6], "end_to_end", view).is_some());
    }
    let whole = times(&shown[6], "end_to_end", None).unwrap();
    let computing = times(&shown[2], "computing", None).unwrap();
    assert!(whole["p50_ms"].as_f64() > computing["p50_ms"].as_f64());

    let top = case.start(&["top", "deployment.toml", "--once"]);
    let top = top.wait_among_others().ends(0);
    for name in PROCESSES {
        let lines = top.stdout.lines().filter(|line| line.starts_with(name));
        assert_eq!(lines.count(), 2, "{name}: {}", top.stdout);
    }
    for title in [
        "p99.9 ms",
        "MEMORY MB",
        "EVIDENCE MB",
        "DROPPED",
        "end to end",
    ] {
        assert!(top.stdout.contains(title), "{title}: {}", top.stdout);
    }

    signal("INT", started.id());
    assert_eq!(started.wait().status.code(), Some(130));
    case.assert_nothing_left();
}

#[test]
fn status_of_a_starting_run_lists_all_its_processes() {
    for _ in 0..3 {
        let case = Case::new("begins", &[600; 2], PACED);
        let mut started = case.start(&["run", "deployment.toml"]);
        let mut shown = String::new();
        started.until("an answer", |_| {
            let ended = case.start(&["status", &case.name, "--json"]);
            let ended = ended.wait_among_others();
            let is_there = ended.status.code() == Some(0);
            assert!(
                is_there || ended.stderr.contains("does not run"),
                "{}",
                ended.stderr
            );
            shown = ended.stdout;
            is_there
        });
        let shown: Value = serde_json::from_str(&shown).unwrap();
        let shown = shown["deployment"]["processes"].as_array().unwrap();
        let names = shown.iter().map(|shown| shown["process"].as_str().unwrap());
        assert!(names.eq(PROCESSES), "{shown:#?}");
        signal("INT", started.id());
        started.wait();
        case.assert_nothing_left();
    }
}

#[test]
fn a_process_that_was_killed_is_shown_with_its_restart() {
    let case = Case::new("restarted", &[600; 2], PACED);
    let mut started = case.start(&["run", "deployment.toml"]);
    started.until("three frames", |_| case.lines("pose3d.jsonl").len() >= 3);
    let pid = started.pid_of("pose --index 1");
    signal("KILL", pid.into());
    let mut states = Vec::new();
    started.until("the next life", |_| {
        let pose = &processes(&case)[3];
        states.push(pose["state"].to_string());
        pose["state"] == "runs" && pose["measured"]["restarts"] == 1
    });
    assert!(
        states.iter().all(|state| state != "\"silent\""),
        "{states:?}"
    );
    signal("INT", started.id());
    assert_eq!(started.wait().status.code(), Some(130));
    case.assert_nothing_left();
}

#[test]
fn watching_a_deployment_that_does_not_run_is_refused() {
    let case = Case::new("absent", &[1], "");
    for arguments in [["status", &case.name], ["top", "deployment.toml"]] {
        let ended = case.start(&arguments).wait().ends(2);
        ended.says(&case.name);
        ended.says("does not run");
    }
}

/// Runs a deployment with a latency budget.
fn budgeted(case: &Case, budget: &str) -> Ended {
    let arguments = ["run", "deployment.toml", "--json", "--latency-budget-ms"];
    let arguments: Vec<&str> = arguments.into_iter().chain([budget]).collect();
    case.start(&arguments).wait()
}

#[test]
fn a_run_that_misses_its_latency_budget_fails_and_reports_the_times_of_its_stages() {
    let case = Case::new("budget", &[6; 2], PLAIN);
    let ended = budgeted(&case, "0.001").ends(6);
    for said in [
        "latency budget of 0.001 ms exceeded",
        "p99.9",
        "triangulate",
        "end to end",
    ] {
        assert!(ended.stderr.contains(said), "{said}: {}", ended.stderr);
    }
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(report["latency_budget"]["held"], false);
    assert_eq!(report["degraded"], false);
    for name in PROCESSES {
        let it = &report["processes"][name];
        assert_eq!(it["finished"], true, "{name}: {it:#}");
        assert!(
            !it["times"].as_array().unwrap().is_empty(),
            "{name}: {it:#}"
        );
    }
    // The last heartbeat is sent at the end, so it counts all frames.
    assert_eq!(report["processes"]["results"]["sent"], 6);

    let ended = budgeted(&case, "600000").ends(0);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(report["latency_budget"]["held"], true);
    assert_eq!(report["latency_budget"]["frames"], 6);
}

#[test]
fn an_invalid_latency_budget_is_refused() {
    let case = Case::new("no-budget", &[1; 2], PLAIN);
    for wrong in ["0", "nan", "-5", "fast"] {
        budgeted(&case, wrong).ends(2).says("--latency-budget-ms");
    }
    let set = [
        "run",
        "deployment.toml",
        "--set",
        "supervise.latency_budget_ms=0",
    ];
    case.start(&set).wait().ends(3).says("above 0");
}
