//! What runs is shown, and what a killed run leaves behind is removed.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use common::started::signal;
use common::{Case, PACED};
use serde_json::Value;

/// What `status` says of the deployment of a case.
fn status(case: &Case) -> Option<Value> {
    let ended = case.start(&["status", "--json"]).wait_among_others();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let all: Value = serde_json::from_str(&ended.stdout).unwrap();
    let all = all["deployments"].as_array().unwrap();
    all.iter().find(|it| it["name"] == case.name).cloned()
}

#[test]
fn a_run_is_shown_and_when_it_was_killed_removed() {
    let case = Case::new("remains", &[400; 2], PACED);
    assert_eq!(status(&case), None);
    let mut started = case.start(&["run", "deployment.toml"]);
    started.until("three frames", |_| case.lines("pose3d.jsonl").len() >= 3);

    let shown = status(&case).unwrap();
    assert_eq!(shown["supervisor"], started.id());
    let processes = shown["processes"].to_string();
    for name in [
        "supervisor",
        "capture-0",
        "pose-1",
        "fuse-0",
        "triangulate",
        "record",
    ] {
        assert!(processes.contains(name), "{name}: {processes}");
    }
    assert!(shown["bytes"].as_u64() > Some(100_000), "{shown}");
    let refused = case.start(&["clean", &case.name]).wait_among_others();
    assert_eq!(refused.status.code(), Some(1));
    assert!(
        refused.stderr.contains("already running"),
        "{}",
        refused.stderr
    );

    signal("KILL", started.id());
    let ended = started.wait_among_others();
    assert_eq!(ended.status.code(), None, "it was killed");
    let shown = status(&case).unwrap();
    assert_eq!(shown["supervisor"], Value::Null);
    assert!(shown["files"].as_u64() > Some(10), "{shown}");
    let cleaned = case.start(&["clean", &case.name, "--json"]).wait();
    assert_eq!(cleaned.status.code(), Some(0), "{}", cleaned.stderr);
    let cleaned: Value = serde_json::from_str(&cleaned.stdout).unwrap();
    assert_eq!(cleaned["removed"][0]["name"], case.name.as_str());
    case.assert_nothing_left();
    assert_eq!(status(&case), None);
}

#[test]
fn a_name_of_nothing_is_refused() {
    let case = Case::new("nothing", &[1], "");
    let ended = case.start(&["clean", &case.name]).wait();
    assert_eq!(ended.status.code(), Some(2));
    assert!(ended.stderr.contains(&case.name), "{}", ended.stderr);
}
