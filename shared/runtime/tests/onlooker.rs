//! Those who look at a deployment see all of its processes, and are in nobody's way.

use crate::common;

use core::time::Duration;
use std::sync::mpsc;
use std::thread::{Builder, sleep};
use std::time::Instant;

use common::{Deployment, shared_memory};
use messages::{Metrics, topic};
use runtime::{Onlooker, OnlookerError, process_topics};

/// A deployment of two processes.
fn two() -> Deployment {
    let topics: Vec<_> = ["a", "b"].into_iter().flat_map(process_topics).collect();
    Deployment::new(&topics)
}

#[test]
fn sees_who_should_be_there_who_lives_and_what_they_said_last() {
    let deployment = two();
    let mut onlooker = Onlooker::open(deployment.namespace()).unwrap();
    let bus = deployment.bus("b");
    let publisher = bus.publisher::<Metrics>(&topic::metrics("b")).unwrap();
    for n_sent in 1..=3 {
        let said = Metrics {
            n_sent,
            ..Metrics::default()
        };
        publisher.send(&said).unwrap();
    }
    let own = Some(std::process::id());
    let seen: Vec<_> = onlooker
        .look()
        .unwrap()
        .iter()
        .map(|it| (it.process.to_owned(), it.pid, it.said.map(|it| it.n_sent)))
        .collect();
    let expected = [("a".to_owned(), None, None), ("b".to_owned(), own, Some(3))];
    assert_eq!(seen, expected);
    drop((publisher, bus));
    let seen = onlooker.look().unwrap();
    assert_eq!(seen[1].pid, None, "it has ended");
    assert_eq!(seen[1].said.unwrap().n_sent, 3, "what it said is kept");
}

#[test]
fn four_may_look_and_a_fifth_is_told_so() {
    let deployment = two();
    let namespace = deployment.namespace();
    let open = || Onlooker::open(namespace);
    let first: Vec<_> = (0..5).map(|_| open().unwrap()).collect();
    let refused = open().unwrap_err();
    assert!(matches!(refused, OnlookerError::Port(_)), "{refused}");
    drop(first);
    open().unwrap();
}

#[test]
fn what_does_not_run_is_refused_and_nothing_is_made_of_it() {
    let deployment = two();
    let namespace = deployment.namespace().clone();
    drop(deployment);
    let refused = Onlooker::open(&namespace).unwrap_err();
    assert!(
        matches!(refused, OnlookerError::NotRunning { .. }),
        "{refused}"
    );
    assert!(!namespace.root().exists());
}

#[test]
fn who_looks_is_told_of_the_end_and_nothing_is_left() {
    let deployment = two();
    let namespace = deployment.namespace().clone();
    let where_to = namespace.clone();
    let (sender, is_open) = mpsc::sync_channel(1);
    let looks = Builder::new().name("onlooker".to_owned()).spawn(move || {
        let onlooker = Onlooker::open(&where_to).unwrap();
        sender.send(()).unwrap();
        let begin = Instant::now();
        while !onlooker.is_over() && begin.elapsed() < Duration::from_mins(1) {
            sleep(Duration::from_millis(10));
        }
        onlooker.is_over()
    });
    let looks = looks.unwrap();
    is_open.recv().unwrap();
    drop(deployment);
    assert!(looks.join().unwrap());
    assert_eq!(shared_memory(&namespace), Vec::<String>::new());
    assert!(!namespace.root().exists());
}
