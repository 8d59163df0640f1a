//! Only one run of a deployment is possible at a time, and it leaves no files behind.

use crate::common;

use std::fs;

use common::{Deployment, namespace, shared_memory};
use failure::Stop;
use messages::Health;
use runtime::{Bus, LockError, Namespace, NamespaceError, process_topics};

#[test]
fn a_running_deployment_is_not_started_again() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let namespace = namespace(base.path());
    let lock = namespace.acquire().unwrap();
    let error = namespace.acquire().unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, LockError::AlreadyRunning { .. }), "{text}");
    assert!(text.contains(&std::process::id().to_string()), "{text}");
    drop(lock);
    namespace.acquire().unwrap();
}

#[test]
fn no_file_is_left_after_the_end() {
    let deployment = Deployment::new(&process_topics("a"));
    let namespace = deployment.namespace().clone();
    let bus = deployment.bus("a");
    let publisher = bus.publisher::<Health>("health/v5/a").unwrap();
    assert!(!shared_memory(&namespace).is_empty());
    assert!(namespace.config_file().exists());
    drop((publisher, bus));
    drop(deployment);
    assert_eq!(shared_memory(&namespace), Vec::<String>::new());
    assert!(!namespace.root().exists());
}

#[test]
fn files_of_a_killed_run_are_removed() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let namespace = namespace(base.path());
    let leftover = format!("/dev/shm/{}123.data", namespace.prefix());
    // Leave the files of a killed run: its directory has the marker file.
    std::mem::forget(namespace.acquire().unwrap());
    fs::remove_file(namespace.root().join("lock")).unwrap();
    fs::write(&leftover, "x").unwrap();
    fs::create_dir_all(namespace.root().join("nodes/17")).unwrap();
    fs::write(namespace.root().join("nodes/17/node.details"), "x").unwrap();
    let lock = namespace.acquire().unwrap();
    assert!(!fs::exists(&leftover).unwrap());
    assert!(!namespace.root().join("nodes/17").exists());
    drop(lock);
}

#[test]
fn files_of_other_programs_are_kept() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let (own, other) = (namespace(base.path()), namespace(base.path()));
    let path = format!("/dev/shm/{}123.data", other.prefix());
    fs::write(&path, "x").unwrap();
    drop(own.acquire().unwrap());
    assert!(fs::exists(&path).unwrap());
    fs::remove_file(&path).unwrap();
}

#[test]
fn a_deployment_with_a_living_process_is_not_removed() {
    let base = tempfile::tempdir_in("/dev/shm").unwrap();
    let namespace = namespace(base.path());
    let bus = Bus::open(&namespace, "survivor", &Stop::new().unwrap()).unwrap();
    let error = namespace.acquire().unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, LockError::StillAlive { .. }), "{text}");
    assert!(text.contains("survivor"), "{text}");
    drop(bus);
    namespace.acquire().unwrap();
}

#[test]
fn the_longest_allowed_root_leaves_room_for_socket_names() {
    let base = tempfile::Builder::new().prefix("px").tempdir_in("/tmp").unwrap();
    let pad = 50 - base.path().as_os_str().len() - "//nn".len();
    let longest = base.path().join("b".repeat(pad));
    let namespace = Namespace::below("n", &longest).unwrap();
    assert_eq!(namespace.root().as_os_str().len(), 49);
    let namespace = Namespace::below("nn", &longest).unwrap();
    assert_eq!(namespace.root().as_os_str().len(), 50);
    let lock = namespace.acquire().unwrap();
    let stop = Stop::new().unwrap();
    let bus = Bus::open(&namespace, "p", &stop).unwrap();
    let plan = runtime::TopicPlan::messages::<Health>(
        "t".to_owned(),
        runtime::Delivery::Lossless,
        runtime::Limits::new(1, 1, 1),
    );
    let topics = bus.create_topics(&[plan]).unwrap();
    let mut waiter = bus.waiter();
    bus.subscriber::<Health>("t", &mut waiter).unwrap();
    let error = Namespace::below("nnn", &longest).unwrap_err();
    assert!(matches!(
        error,
        NamespaceError::RootTooLong {
            len: 51,
            max: 50,
            ..
        }
    ));
    drop((waiter, topics, bus, lock));
}

#[test]
fn invalid_directory_names_are_refused() {
    for name in ["", ".", "..", "a/b", "a b", "\u{e4}", &"x".repeat(33)] {
        let error = Namespace::new(name).unwrap_err();
        assert!(
            matches!(error, NamespaceError::Name { .. }),
            "{name}: {error}"
        );
    }
    for name in ["a", "pose2sim-balancing", "A_1.2"] {
        assert_eq!(Namespace::new(name).unwrap().name(), name);
    }
}

#[test]
fn every_process_computes_the_same_namespace() {
    let (one, two) = (
        Namespace::new("walk").unwrap(),
        Namespace::new("walk").unwrap(),
    );
    assert_eq!(one, two);
    assert_ne!(one.prefix(), Namespace::new("run").unwrap().prefix());
}
