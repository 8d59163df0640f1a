//! Tests of deployments without faults.

use crate::common;

use core::time::Duration;
use std::time::Instant;

use common::{Case, Recorded, is_alive};
use failure::{ExitKind, Fault as _};
use runtime::Delivery;
use supervise::{Role, State, SuperviseError};

#[test]
fn a_lossless_run_loses_no_frame_and_ends_by_itself() {
    let case = Case::new(
        Delivery::Lossless,
        &[
            ("sink", "receive 1", Role::Essential),
            ("source", "send 100 0 1", Role::Essential),
        ],
    );
    let run = case.run(|_, _| {});
    let expected: Vec<_> = (0..100).map(|frame| (0, frame)).collect();
    assert_eq!(run.got("sink"), expected);
    let outcome = run.outcome();
    assert!(!outcome.interrupted && !outcome.is_degraded());
    let [sink, source] = outcome.processes.as_slice() else {
        panic!("{outcome:?}");
    };
    assert_eq!(
        (sink.state, source.state),
        (State::Finished, State::Finished)
    );
    assert_eq!((sink.counts.n_received, source.counts.n_sent), (100, 100));
    assert_eq!((sink.restarts, source.restarts), (0, 0));
    assert_eq!(source.last.unwrap().n_total, 100);
    assert_eq!(source.last.unwrap().session, 42);
}

#[test]
fn a_realtime_run_does_not_wait_for_a_slow_receiver() {
    let case = Case::new(
        Delivery::Realtime,
        &[
            ("sink", "receive 40", Role::Essential),
            ("source", "send 200 1 1", Role::Essential),
        ],
    );
    let run = case.run(|_, _| {});
    let got: Vec<_> = run.got("sink").into_iter().map(|(_, frame)| frame).collect();
    assert!(got.len() < 200, "{got:?}");
    assert!(got.is_sorted_by(|a, b| a < b), "{got:?}");
    assert_eq!(run.outcome().processes[1].counts.n_sent, 200);
}

#[test]
fn a_stop_request_ends_all_processes_cleanly() {
    let case = Case::new(
        Delivery::Realtime,
        &[
            ("sink", "receive 0", Role::Essential),
            ("source", "send 1000000 1 1", Role::Essential),
        ],
    );
    let run = case.run(|event, stop| {
        if matches!(event, Recorded::Line(_, line) if line == "sent 16") {
            stop.request();
        }
    });
    let outcome = run.outcome();
    assert!(outcome.interrupted);
    assert!(outcome.processes.iter().all(|process| process.state == State::Stopped));
    assert!(run.deaths("sink").is_empty() && run.deaths("source").is_empty());
}

#[test]
fn a_process_that_ignores_the_stop_request_is_killed() {
    let mut case = Case::new(Delivery::Realtime, &[("rock", "stubborn", Role::Essential)]);
    case.plan.policy.grace = Duration::from_millis(300);
    let run = case.run(|_, _| {});
    assert!(!is_alive(run.pids("rock")[0]));
    assert_eq!(run.outcome().processes[0].state, State::Finished);
    assert!(run.events.contains(&Recorded::Killed("rock".to_owned())));
}

#[test]
fn a_process_that_completes_files_has_more_time_after_the_stop_request() {
    let mut case = Case::new(Delivery::Realtime, &[("rock", "stubborn", Role::Essential)]);
    case.plan.policy.grace = Duration::from_millis(100);
    case.plan.policy.hang_limit = Duration::from_secs(2);
    case.plan.processes[0].completes_files = true;
    let run = case.run(|_, _| {});
    let at = |event: Recorded| run.events.iter().position(|other| *other == event).unwrap();
    let rock = || "rock".to_owned();
    assert!(at(Recorded::Awaited(rock())) < at(Recorded::Killed(rock())));
}

#[test]
fn children_of_a_process_end_with_it() {
    let case = Case::new(Delivery::Realtime, &[("parent", "orphan", Role::Essential)]);
    let mut orphan = None;
    let run = case.run(|event, _| {
        if let Recorded::Line(_, line) = event {
            orphan = line.strip_prefix("child ").map(|pid| pid.parse().unwrap());
        }
    });
    run.outcome();
    let begin = Instant::now();
    while is_alive(orphan.unwrap()) && begin.elapsed() < Duration::from_mins(1) {
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(!is_alive(orphan.unwrap()));
}

#[test]
fn wrong_input_fails_the_run_with_the_message_and_status_of_the_process() {
    let case = Case::new(
        Delivery::Realtime,
        &[
            ("good", "idle", Role::Essential),
            ("bad", "fail 4", Role::Optional),
        ],
    );
    let error = case.run(|_, _| {}).result.unwrap_err();
    assert_eq!(error.kind(), ExitKind::Input);
    let text = error.to_string();
    assert!(
        text.contains("bad cannot work: error: model.bin: byte 17 is wrong"),
        "{text}"
    );
    assert!(text.contains("hint: take another"), "{text}");
}

#[test]
fn a_missing_program_is_named() {
    let mut case = Case::new(Delivery::Realtime, &[("ghost", "idle", Role::Essential)]);
    case.plan.executable = "/nowhere/parallax".into();
    case.plan.policy.max_restarts = 1;
    let error = case.run(|_, _| {}).result.unwrap_err();
    assert!(
        matches!(error, SuperviseError::GivenUp { restarts: 1, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("/nowhere/parallax"), "{error}");
}

#[test]
fn another_type_of_message_is_a_clear_error() {
    let mut case = Case::new(
        Delivery::Realtime,
        &[("odd", "wrong-type", Role::Essential)],
    );
    case.plan.policy.max_restarts = 0;
    let error = case.run(|_, _| {}).result.unwrap_err();
    assert!(
        error.to_string().contains("topic \"data\" does not carry"),
        "{error}"
    );
}

#[test]
fn two_deployments_run_side_by_side() {
    let make = || {
        Case::new(
            Delivery::Lossless,
            &[
                ("sink", "receive 0", Role::Essential),
                ("source", "send 20 1 1", Role::Essential),
            ],
        )
    };
    let (one, two) = (make(), make());
    let second = std::thread::Builder::new()
        .spawn(move || two.run(|_, _| {}).got("sink"))
        .unwrap();
    let expected: Vec<_> = (0..20).map(|frame| (0, frame)).collect();
    assert_eq!(one.run(|_, _| {}).got("sink"), expected);
    assert_eq!(second.join().unwrap(), expected);
}

#[test]
fn a_run_that_was_killed_is_cleaned_up_by_the_next() {
    let case = Case::new(Delivery::Realtime, &[("only", "idle", Role::Essential)]);
    let leftover = format!("/dev/shm/{}7_9.connection", case.plan.namespace.prefix());
    std::fs::write(&leftover, "x").unwrap();
    case.run(|_, _| {}).outcome();
    assert!(!std::fs::exists(&leftover).unwrap());
}
