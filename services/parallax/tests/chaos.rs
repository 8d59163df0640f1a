//! Tests of `parallax chaos` with a short deployment: real processes, real kills, verdicts and exit codes.

use crate::common;

use std::fs;

use common::{Case, Ended, PACED};
use serde_json::Value;

/// Runs scenarios on a small deployment. Returns the exit and `chaos.json`.
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
fn a_missed_limit_of_a_scenario_is_named_and_gives_exit_code_6() {
    let case = Case::new("chaos-missed", &[40; 2], PACED);
    let (ended, report) = chaos(&case, "kill-fuse", &["--max-return-ms", "0"]);
    assert_eq!(ended.status.code(), Some(6), "{}\n{report:#}", ended.stderr);
    assert_eq!(report["held"], false);
    let limits = report["scenarios"][0]["limits"].as_array().unwrap();
    let back = limits.iter().find(|limit| limit["what"] == "time until back, ms");
    assert_eq!(back.unwrap()["held"], false, "{report:#}");
}

#[test]
fn scenarios_are_listed_and_impossible_ones_are_refused() {
    let case = Case::new("chaos-list", &[2; 2], PACED);
    let ended = case.start(&["chaos", "--list"]).wait().ends(0);
    for name in [
        "kill-capture",
        "hang-fuse",
        "kill-random",
        "kill-supervisor",
        "camera-freeze",
        "stall-results",
    ] {
        assert!(ended.stdout.contains(name), "{name}: {}", ended.stdout);
    }
    let (ended, _) = chaos(&case, "kill-quality", &[]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    ended.says("no such process");
    let (ended, _) = chaos(&case, "kill-nobody", &[]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    ended.says("--list");
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use serde_json::json;

    use super::*;

    /// Limits for a loaded machine, which are sufficient for two seconds of results.
    const PATIENT: [&str; 4] = ["--max-return-ms", "60000", "--max-pause-ms", "60000"];

    #[test]
    #[ignore = "takes long"]
    fn in_a_realtime_run_a_hung_process_is_detected_by_its_missing_progress() {
        // The time limit alone would only detect the hang after ten minutes.
        let live = PACED.replace("\"paced\"", "\"realtime\"");
        let patient = format!("{live}[supervise]\nhang_limit_s = 600\n");
        let case = Case::new("chaos-spin", &[240; 3], &patient);
        let (ended, report) = chaos(&case, "spin-pose,spin-fuse,spin-triangulate", &PATIENT);
        let scenarios = report["scenarios"].as_array().unwrap();
        assert_eq!(scenarios.len(), 3, "{}", ended.stderr);
        for it in scenarios {
            let measured = &it["measured"];
            let expected = json!([{ "process": measured["process"], "restarts": 1 }]);
            // On a loaded machine, the footage may end before the process has been restarted.
            assert_eq!(it["run"]["restarts"], expected, "{it:#}");
        }
    }

    #[test]
    #[ignore = "takes long"]
    fn a_killed_view_recovers_and_a_run_after_a_killed_supervisor_works() {
        let case = Case::new("chaos", &[80; 3], PACED);
        let (ended, report) = chaos(
            &case,
            "kill-pose,spin-capture,kill-supervisor,stall-results",
            &PATIENT,
        );
        assert_eq!(ended.status.code(), Some(0), "{}\n{report:#}", ended.stderr);
        let printed: Value = serde_json::from_str(&ended.stdout).unwrap();
        assert_eq!(printed, report, "the same on standard output");

        let [pose, spin, supervisor, stall] = &report["scenarios"].as_array().unwrap()[..] else {
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

        let cost = &spin["measured"]["cost"];
        assert!(cost["noticed_ms"].as_f64() > Some(1000.0), "{spin:#}");
        assert!(cost["back_ms"].is_number(), "{spin:#}");
        let restarts = spin["run"]["restarts"].as_array().unwrap();
        assert_eq!(restarts.len(), 1, "{spin:#}");

        let measured = &supervisor["measured"];
        assert!(measured["files_left"].as_u64() > Some(10), "{measured:#}");
        assert!(measured["children_ended_ms"].is_number(), "{measured:#}");
        assert_eq!(
            supervisor["run"]["restarts"],
            json!([]),
            "no process was killed"
        );
        // With lossless delivery, senders wait for a suspended results process, and nothing is lost.
        let limits = stall["limits"].as_array().unwrap().iter();
        let written = limits.clone().find(|limit| limit["what"] == "results written");
        assert_eq!(written.unwrap()["measured"], "80", "{stall:#}");
        assert_eq!(
            case.lines("pose3d.jsonl").len(),
            0,
            "not into its own folder"
        );
    }

    #[test]
    #[ignore = "takes long"]
    fn a_failing_camera_recovers_and_a_stalled_results_process_delays_no_other_process() {
        let live = PACED.replace("\"paced\"", "\"realtime\"");
        let case = Case::new("chaos-camera", &[160; 3], &live);
        let (ended, report) = chaos(&case, "camera-unplug,camera-clock,stall-results", &PATIENT);
        let [unplug, clock, stall] = &report["scenarios"].as_array().unwrap()[..] else {
            panic!("{}\n{report:#}", ended.stderr)
        };
        let flagged = |value: &Value| {
            let causes = value["measured"]["flagged"].as_array().unwrap().iter();
            let causes = causes.map(|cause| {
                (
                    cause[0].as_str().unwrap().to_owned(),
                    cause[1].as_u64().unwrap(),
                )
            });
            causes.collect::<Vec<_>>()
        };
        for (it, n_causes) in [(unplug, 1), (clock, 3)] {
            let flagged = flagged(it);
            assert_eq!(flagged.len(), n_causes);
            assert!(
                flagged.iter().all(|cause| cause.1 > 0),
                "{flagged:?}\n{}",
                ended.stderr
            );
            assert!(it["measured"]["back_ms"].is_number(), "{it:#}");
            let camera = &it["measured"]["camera"];
            let views = it["run"]["views"].as_array().unwrap();
            let view = views.iter().find(|view| view["name"] == *camera).unwrap();
            for (cause, n) in flagged {
                assert!(
                    view["faults"][&cause].as_u64() >= Some(n),
                    "{cause}: {view:#}"
                );
            }
            assert_eq!(
                it["run"]["restarts"],
                json!([]),
                "the process itself is well"
            );
        }
        assert!(
            stall["measured"]["stall_ms"].as_f64() >= Some(3000.0),
            "{stall:#}"
        );
        assert_eq!(
            stall["run"]["restarts"],
            json!([]),
            "it must not count as hung"
        );
    }
}
