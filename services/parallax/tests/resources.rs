//! What a run does without: descriptors, a name of its own, and what belongs to somebody else.
#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

mod common;

use std::fs;
use std::os::unix::fs::{MetadataExt as _, chown};

use common::{Case, Ended, PACED, PLAIN};
use runtime::Namespace;

/// Not the user who runs tests.
const OTHER: u32 = 65_534;

/// Nothing of a run was ended by a fault of memory.
fn assert_no_bus_error(ended: &Ended) {
    for words in ["signal 7", "SIGBUS", "signal 11", "panic"] {
        assert!(!ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
}

#[test]
fn too_few_descriptors_are_refused_with_the_numbers() {
    let case = Case::new("descriptors", &[2; 2], PLAIN);
    let ended = case
        .start_in_shell("ulimit -n 64; exec \"$PARALLAX\" run deployment.toml --json")
        .wait();
    case.assert_nothing_left();
    assert_no_bus_error(&ended);
    assert_eq!(ended.status.code(), Some(3), "{}", ended.stderr);
    for words in ["64 open files", "ulimit -n"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
}

#[test]
fn a_second_run_of_the_same_name_is_refused_and_the_first_goes_on() {
    let case = Case::new("twice", &[60; 2], PACED);
    let mut first = case.start(&["run", "deployment.toml", "--json"]);
    first.until("five frames", |_| case.lines("pose3d.jsonl").len() >= 5);
    let id = first.id();
    let second = case.start(&["run", "deployment.toml", "--json", "--set", "output=other"]);
    let second = second.wait_among_others();
    assert_eq!(second.status.code(), Some(1), "{}", second.stderr);
    let said = format!("is already running (process {id})");
    assert!(second.stderr.contains(&said), "{}", second.stderr);
    let ended = first.wait();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    case.assert_nothing_left();
}

#[test]
fn the_leftovers_of_another_user_are_named_with_what_to_do() {
    let case = Case::new("foreign", &[2; 2], PLAIN);
    let namespace = Namespace::new(&case.name).unwrap();
    fs::create_dir_all(namespace.root()).unwrap();
    if fs::metadata(namespace.root()).unwrap().uid() != 0 {
        fs::remove_dir(namespace.root()).unwrap();
        eprintln!("skipped: only root can give a directory to another user");
        return;
    }
    chown(namespace.root(), Some(OTHER), None).unwrap();
    let ended = case.start(&["run", "deployment.toml"]).wait();
    fs::remove_dir(namespace.root()).unwrap();
    assert_eq!(ended.status.code(), Some(1), "{}", ended.stderr);
    let root = namespace.root().display().to_string();
    for words in [&root, "belongs to user", "65534", "user root (0)", "rm -r"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
}
