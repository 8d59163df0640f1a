//! Tests that running deployments are listed, and leftovers of a killed run are removed.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

use crate::common;

use std::fs;

use common::started::signal;
use common::{Case, PACED, Started};
use serde_json::Value;

/// Returns the deployment of a case in `status`.
fn status(case: &Case) -> Option<Value> {
    let ended = case.start(&["status", "--json"]).wait_among_others().ends(0);
    let all: Value = serde_json::from_str(&ended.stdout).unwrap();
    let all = all["deployments"].as_array().unwrap();
    all.iter().find(|value| value["name"] == case.name).cloned()
}

#[test]
fn a_run_is_listed_and_removed_after_it_was_killed() {
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
        "results",
    ] {
        assert!(processes.contains(name), "{name}: {processes}");
    }
    assert!(shown["bytes"].as_u64() > Some(100_000), "{shown}");
    let refused = case.start(&["clean", &case.name]).wait_among_others();
    assert_eq!(refused.status.code(), Some(1));
    refused.says("already running");

    signal("KILL", started.id());
    let ended = started.wait_among_others();
    assert_eq!(ended.status.code(), None, "it was killed");
    let shown = status(&case).unwrap();
    assert_eq!(shown["supervisor"], Value::Null);
    assert!(shown["files"].as_u64() > Some(10), "{shown}");
    let cleaned = case.start(&["clean", &case.name, "--json"]).wait().ends(0);
    let cleaned: Value = serde_json::from_str(&cleaned.stdout).unwrap();
    assert_eq!(cleaned["removed"][0]["name"], case.name.as_str());
    case.assert_nothing_left();
    assert_eq!(status(&case), None);
}

#[test]
fn an_unknown_deployment_name_is_refused() {
    let case = Case::new("nothing", &[1], "");
    let ended = case.start(&["clean", &case.name]).wait();
    assert_eq!(ended.status.code(), Some(2));
    ended.says(&case.name);
}

#[test]
fn foreign_files_are_named_and_kept_and_links_are_not_followed() {
    let case = Case::new("stays", &[2; 2], "");
    // First, the foreign folder is beside the deployments. Then a link replaces the directory of the deployments.
    let script = "mount -t tmpfs tmpfs /dev/shm\n\
        base=/dev/shm/px-$(id -u); name=$(sed -n 's/^name = \"\\(.*\\)\"/\\1/p' deployment.toml | head -n 1)\n\
        mkdir -m 700 $base; mkdir $base/photos $base/$name\n\
        echo x >$base/photos/one.jpg; echo x >$base/$name/letter.txt; cp -r $base before\n\
        attack() {\n\
          for command in clean 'clean photos' status 'run deployment.toml'; do\n\
            code=0; \"$PARALLAX\" $command >said 2>&1 || code=$?\n\
            echo \"$1 $command: $code\"; cat said\n\
          done\n\
        }\n\
        attack folder; diff -r before $base; rm -r $base\n\
        cp -r before home; chown -h 65534 home; ln -s $PWD/home $base; chown -h 65534 $base\n\
        attack link; diff -r before home";
    let Some(started) = Started::in_mount_namespace(case.folder(), script) else {
        eprintln!("skipped: no private file system may be mounted here");
        return;
    };
    let ended = started.wait();
    let said = &ended.stdout;
    assert_eq!(ended.status.code(), Some(0), "{said}{}", ended.stderr);
    for words in [
        "folder clean: 0",
        "photos: not a deployment: ignored",
        "folder clean photos: 1",
        "folder run deployment.toml: 1",
        "is not the directory of a deployment (files in it: 1;",
        "link clean: 1",
        "link clean photos: 1",
        "link status: 1",
        "link run deployment.toml: 1",
        "is a symbolic link of user nobody (65534)",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(fs::exists(case.path("home/photos/one.jpg")).unwrap());
}
