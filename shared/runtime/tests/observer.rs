//! An observer sees all processes of a deployment and does not disturb them.
#![expect(clippy::print_stderr, reason = "a test reports what it skips")]

use crate::common;

use core::time::Duration;
use std::env;
use std::process::Command;
use std::sync::mpsc;
use std::thread::{Builder, sleep};
use std::time::Instant;

use common::{Deployment, shared_memory};
use messages::{Metrics, topic};
use runtime::{Observer, ObserverError, process_topics};

/// A deployment of two processes.
fn two() -> Deployment {
    let topics: Vec<_> = ["a", "b"].into_iter().flat_map(process_topics).collect();
    Deployment::new(&topics)
}

#[test]
fn lists_all_processes_with_their_pids_and_last_metrics() {
    let deployment = two();
    let mut observer = Observer::open(deployment.namespace()).unwrap();
    let bus = deployment.bus("b");
    let publisher = bus.publisher::<Metrics>(&topic::metrics("b")).unwrap();
    for n_sent in 1..=3 {
        let metrics = Metrics {
            n_sent,
            ..Metrics::default()
        };
        publisher.send(&metrics).unwrap();
    }
    let own = Some(std::process::id());
    let seen: Vec<_> = observer
        .observe()
        .unwrap()
        .iter()
        .map(|seen| {
            let n_sent = seen.metrics.map(|metrics| metrics.n_sent);
            (seen.process.to_owned(), seen.pid, n_sent)
        })
        .collect();
    let expected = [("a".to_owned(), None, None), ("b".to_owned(), own, Some(3))];
    assert_eq!(seen, expected);
    drop((publisher, bus));
    let seen = observer.observe().unwrap();
    assert_eq!(seen[1].pid, None, "it has ended");
    assert_eq!(
        seen[1].metrics.unwrap().n_sent,
        3,
        "its last metrics are kept"
    );
}

#[test]
fn a_deployment_is_seen_from_another_pid_namespace() {
    const BASE: &str = "PARALLAX_TEST_BASE";
    if let Some(base) = env::var_os(BASE) {
        assert_eq!(std::process::id(), 1, "this is the other namespace");
        let found = runtime::deployments(base.as_ref()).unwrap();
        let mut observer = Observer::open(&found[0].namespace).unwrap();
        assert_eq!(found[0].supervisor, Some(observer.supervisor()));
        assert_eq!(observer.observe().unwrap().len(), 2);
        assert!(!observer.is_over());
        return;
    }
    let within = || {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--pid", "--fork", "--mount-proc"]);
        command
    };
    if !within().arg("true").status().is_ok_and(|status| status.success()) {
        eprintln!("skipped: no pid namespace may be made here");
        return;
    }
    let deployment = two();
    let own = "observer::a_deployment_is_seen_from_another_pid_namespace";
    let mut again = within();
    again.arg(env::current_exe().unwrap()).args(["--exact", own]);
    let ended = again.env(BASE, deployment.namespace().base()).output().unwrap();
    let said = String::from_utf8_lossy(&ended.stdout);
    assert!(said.contains("1 passed"), "{said}");
}

#[test]
fn too_many_observers_are_refused() {
    let deployment = two();
    let namespace = deployment.namespace();
    let open = || Observer::open(namespace);
    let first: Vec<_> = (0..5).map(|_| open().unwrap()).collect();
    let refused = open().unwrap_err();
    assert!(matches!(refused, ObserverError::Port(_)), "{refused}");
    drop(first);
    open().unwrap();
}

#[test]
fn a_deployment_that_does_not_run_is_refused_and_no_file_is_created() {
    let deployment = two();
    let namespace = deployment.namespace().clone();
    drop(deployment);
    let refused = Observer::open(&namespace).unwrap_err();
    assert!(
        matches!(refused, ObserverError::NotRunning { .. }),
        "{refused}"
    );
    assert!(!namespace.root().exists());
}

#[test]
fn an_observer_leaves_when_the_deployment_ends_and_no_file_is_left() {
    let deployment = two();
    let namespace = deployment.namespace().clone();
    let observed = namespace.clone();
    let (sender, is_open) = mpsc::sync_channel(1);
    let thread = Builder::new().name("observer".to_owned()).spawn(move || {
        let observer = Observer::open(&observed).unwrap();
        sender.send(()).unwrap();
        let begin = Instant::now();
        while !observer.is_over() && begin.elapsed() < Duration::from_mins(1) {
            sleep(Duration::from_millis(10));
        }
        observer.is_over()
    });
    let thread = thread.unwrap();
    is_open.recv().unwrap();
    drop(deployment);
    assert!(thread.join().unwrap());
    assert_eq!(shared_memory(&namespace), Vec::<String>::new());
    assert!(!namespace.root().exists());
}
