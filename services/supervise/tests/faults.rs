//! Tests of deployments whose processes are killed, stopped, or fail.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test reports that it is skipped")]

use crate::common;

use core::time::Duration;
use std::cell::Cell;
use std::io::{BufRead as _, BufReader};
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Command, Stdio};

use common::{Case, Recorded, Run, is_alive, kill};
use failure::{ExitKind, Fault as _};
use runtime::Delivery;
use supervise::{Death, Role, State, SuperviseError};

const KILLED: Death = Death::Signal { number: 9 };

/// Kills a process at the first matching event.
fn kill_once<'a>(
    process: &'a str,
    signal: &'a str,
    when: impl Fn(&Recorded) -> bool + 'a,
) -> impl FnMut(&Recorded, &failure::Stop) + 'a {
    let pid = Cell::new(None);
    let done = Cell::new(false);
    move |event, _| {
        if let Recorded::Started(name, started, 0) = event
            && name == process
        {
            pid.set(Some(*started));
        }
        if !done.get() && when(event) {
            done.set(true);
            kill(signal, pid.get().unwrap());
        }
    }
}

fn is_line(event: &Recorded, process: &str, text: &str) -> bool {
    matches!(event, Recorded::Line(name, line) if name == process && line == text)
}

/// Returns true if the sink reports a frame of this epoch of its sender.
fn is_from_epoch(event: &Recorded, epoch: u32) -> bool {
    let begin = format!("got {epoch} ");
    matches!(event, Recorded::Line(name, line) if name == "sink" && line.starts_with(&begin))
}

fn state_of(run: &Run, process: &str) -> State {
    let outcome = run.outcome();
    outcome
        .processes
        .iter()
        .find(|candidate| candidate.name == process)
        .unwrap()
        .state
}

#[test]
fn a_process_is_stopped_after_all_its_senders_are_given_up() {
    let mut case = Case::new(
        Delivery::Lossless,
        &[
            ("sink", "receive 0", Role::Optional),
            ("view-0", "fail 1", Role::Optional),
            ("view-1", "fail 1", Role::Optional),
        ],
    );
    case.plan.policy.max_restarts = 1;
    case.plan.processes[0].senders = vec!["view-0".to_owned(), "view-1".to_owned()];
    let run = case.run(|_, _| {});
    let dismissed = Recorded::Dismissed("sink".to_owned());
    assert_eq!(run.events.last(), Some(&Recorded::Stopping));
    assert!(run.events.contains(&dismissed), "{:#?}", run.events);
    assert_eq!(state_of(&run, "sink"), State::Stopped);
    assert_eq!(run.deaths("sink"), []);
    assert!(run.outcome().is_degraded());
}

#[test]
fn a_sender_that_waits_for_a_killed_receiver_continues() {
    let mut case = Case::new(
        Delivery::Lossless,
        &[
            ("sink", "receive 0", Role::Essential),
            ("dam", "hold", Role::Optional),
            ("source", "send 50 0 2", Role::Essential),
        ],
    );
    case.plan.policy.max_restarts = 0;
    // The process `sink` received the messages that were sent before the full queue of the process `dam` blocked the sender.
    let run = case.run(kill_once("dam", "-9", |event| {
        is_line(event, "dam", "holding")
    }));
    assert_eq!(run.deaths("dam"), [KILLED]);
    let expected: Vec<_> = (0..50).map(|frame| (0, frame)).collect();
    assert_eq!(run.got("sink"), expected);
    assert_eq!(state_of(&run, "dam"), State::GivenUp);
    assert_eq!(state_of(&run, "source"), State::Finished);
    assert!(run.outcome().is_degraded());
}

#[test]
fn an_incomplete_message_of_a_killed_sender_is_not_received_and_the_restarted_sender_continues() {
    let case = Case::new(
        Delivery::Lossless,
        &[
            ("sink", "receive 0", Role::Essential),
            ("source", "die-in-loan", Role::Essential),
        ],
    );
    let run = case.run(|_, _| {});
    assert_eq!(run.deaths("source"), [KILLED]);
    assert_eq!(run.got("sink"), [(0, 0), (0, 1), (1, 0), (1, 1), (1, 2)]);
    assert!(run.lines("sink").all(|line| line != "torn"));
    assert_eq!(run.outcome().processes[1].restarts, 1);
}

#[test]
fn a_killed_sender_is_restarted_and_the_others_continue() {
    let case = Case::new(
        Delivery::Realtime,
        &[
            ("sink", "receive 0", Role::Essential),
            ("source", "send 1000000 1 1", Role::Redundant),
        ],
    );
    let mut kill = kill_once("source", "-9", |event| is_line(event, "source", "sent 32"));
    let run = case.run(|event, stop| {
        kill(event, stop);
        if is_from_epoch(event, 1) {
            stop.request();
        }
    });
    assert_eq!(run.deaths("source"), [KILLED]);
    assert!(run.deaths("sink").is_empty());
    assert_eq!(run.pids("sink").len(), 1);
    assert_eq!(run.pids("source").len(), 2);
}

#[test]
fn a_process_that_ends_by_a_signal_of_another_program_has_failed() {
    for (signal, number) in [("-TERM", 15), ("-INT", 2), ("-HUP", 1)] {
        let case = Case::new(
            Delivery::Realtime,
            &[
                ("sink", "receive 0", Role::Essential),
                ("source", "send 1000000 1 1", Role::Redundant),
            ],
        );
        let mut kill = kill_once("source", signal, |event| {
            is_line(event, "source", "sent 32")
        });
        let run = case.run(|event, stop| {
            kill(event, stop);
            if is_from_epoch(event, 1) {
                stop.request();
            }
        });
        assert_eq!(run.deaths("source"), [Death::Signal { number }]);
        assert!(run.deaths("sink").is_empty());
        assert_eq!(run.outcome().processes[1].restarts, 1);
    }
}

#[test]
fn a_process_that_exits_before_it_has_finished_has_failed() {
    let case = Case::new(Delivery::Realtime, &[("only", "leave", Role::Essential)]);
    let run = case.run(|_, _| {});
    assert_eq!(run.deaths("only"), [Death::Exit { status: 0 }]);
    assert_eq!(run.outcome().processes[0].restarts, 1);
    assert_eq!(state_of(&run, "only"), State::Finished);
}

#[test]
fn a_receiver_killed_at_the_end_of_stream_is_restarted_and_receives_it() {
    for delivery in [Delivery::Realtime, Delivery::Lossless] {
        let case = Case::new(
            delivery,
            &[
                ("sink", "die-at-end", Role::Essential),
                ("source", "send 20 1 1", Role::Essential),
            ],
        );
        let run = case.run(|_, _| {});
        assert_eq!(run.deaths("sink"), [KILLED]);
        assert_eq!(state_of(&run, "sink"), State::Finished);
        assert!(!run.outcome().is_degraded());
    }
}

#[test]
fn a_stopped_process_is_detected() {
    let mut case = Case::new(
        Delivery::Realtime,
        &[
            ("sink", "receive 0", Role::Essential),
            ("source", "send 1000000 1 1", Role::Essential),
        ],
    );
    // With this limit, only the state of the process can show that it is stopped.
    case.plan.policy.silence_limit = Duration::from_mins(10);
    case.plan.policy.hang_limit = Duration::from_mins(10);
    // The process is stopped after it has sent a heartbeat.
    let mut freeze = kill_once("source", "-STOP", |event| {
        is_line(event, "source", "sent 512")
    });
    let run = case.run(|event, stop| {
        freeze(event, stop);
        if is_from_epoch(event, 1) {
            stop.request();
        }
    });
    let deaths = run.deaths("source");
    assert!(matches!(deaths[..], [Death::Silent { .. }]), "{deaths:?}");
    assert!(!is_alive(run.pids("source")[0]));
}

#[test]
fn a_hanging_main_loop_is_detected() {
    let case = Case::new(
        Delivery::Realtime,
        &[("knot", "hang-once", Role::Essential)],
    );
    let run = case.run(|_, _| {});
    let deaths = run.deaths("knot");
    assert!(matches!(deaths[..], [Death::Hung { .. }]), "{deaths:?}");
    assert_eq!(state_of(&run, "knot"), State::Finished);
}

/// Returns the deaths of a process that first computes for its usual time, and then for a long time.
fn deaths_of_computing_process(how: &str, most_work: Option<u32>) -> Vec<Death> {
    let mut case = Case::new(Delivery::Realtime, &[("mill", how, Role::Essential)]);
    case.plan.policy.hang_limit = Duration::from_mins(10);
    case.plan.processes[0].most_work = most_work;
    let run = case.run(|_, _| {});
    assert_eq!(state_of(&run, "mill"), State::Finished);
    run.deaths("mill")
}

#[test]
fn an_endless_loop_is_detected_by_comparison_with_earlier_work() {
    let deaths = deaths_of_computing_process("compute 20 600000", Some(3));
    assert!(matches!(deaths[..], [Death::Spun { .. }]), "{deaths:?}");
}

#[test]
fn computing_twice_as_long_as_before_is_allowed() {
    assert_eq!(deaths_of_computing_process("compute 300 600", Some(3)), []);
}

#[test]
fn computing_long_is_allowed_without_a_limit() {
    assert_eq!(deaths_of_computing_process("compute 20 1500", None), []);
}

#[test]
fn a_process_that_never_waits_is_not_reported_as_hanging() {
    let mut case = Case::new(
        Delivery::Realtime,
        &[("mill", "compute 20 0", Role::Essential)],
    );
    case.plan.policy.hang_limit = Duration::from_secs(2);
    assert_eq!(case.run(|_, _| {}).deaths("mill"), []);
}

#[test]
fn a_long_computation_is_awaited() {
    let mut case = Case::new(
        Delivery::Lossless,
        &[
            ("sink", "receive 0", Role::Essential),
            ("broken", "fail 1", Role::Optional),
            ("thinker", "think 4", Role::Essential),
            ("source", "send 3 1 1", Role::Essential),
        ],
    );
    // One process fails, some processes finish, and one process computes for longer than the idle limit.
    case.plan.policy.max_restarts = 0;
    let run = case.run(|_, _| {});
    assert_eq!(run.deaths("thinker"), []);
    assert_eq!(state_of(&run, "thinker"), State::Finished);
}

#[test]
fn a_process_that_has_worked_for_a_while_is_restarted_at_once() {
    let processes = [
        ("sink", "receive 0", Role::Essential),
        ("source", "send 1000000 20 1", Role::Essential),
    ];
    let pauses_of = |steady_after| {
        let mut case = Case::new(Delivery::Realtime, &processes);
        case.plan.policy.steady_after = steady_after;
        let sent = |event: &Recorded| is_line(event, "source", "sent 64");
        let mut kill = kill_once("source", "-9", sent);
        let run = case.run(|event, stop| {
            kill(event, stop);
            if matches!(event, Recorded::Restarting(..)) {
                stop.request();
            }
        });
        assert_eq!(run.deaths("source"), [KILLED]);
        let pauses = run.events.iter().filter_map(|event| match event {
            Recorded::Restarting(_, pause) => Some(*pause),
            _ => None,
        });
        pauses.collect::<Vec<_>>()
    };
    assert_eq!(pauses_of(Duration::from_millis(100)), [Duration::ZERO]);
    let first_pause = Duration::from_millis(20);
    assert_eq!(pauses_of(Duration::from_mins(10)), [first_pause]);
}

#[test]
fn a_crashing_process_is_given_up_after_increasing_pauses() {
    let mut case = Case::new(Delivery::Realtime, &[("wreck", "panic", Role::Essential)]);
    case.plan.policy.max_restarts = 3;
    let run = case.run(|_, _| {});
    let pauses: Vec<_> = run
        .events
        .iter()
        .filter_map(|event| match event {
            Recorded::Restarting(_, pause) => Some(pause.as_millis()),
            _ => None,
        })
        .collect();
    assert_eq!(pauses, [20, 40, 80]);
    assert_eq!(run.deaths("wreck"), [Death::Exit { status: 1 }; 4]);
    let error = run.result.unwrap_err();
    assert_eq!(error.kind(), ExitKind::Run);
    assert!(
        matches!(error, SuperviseError::GivenUp { restarts: 3, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("on purpose"), "{error}");
}

#[test]
fn an_optional_process_that_keeps_dying_does_not_stop_the_run() {
    let mut case = Case::new(
        Delivery::Lossless,
        &[
            ("sink", "receive 0", Role::Essential),
            ("results", "fail 1", Role::Optional),
            ("source", "send 50 1 1", Role::Essential),
        ],
    );
    case.plan.policy.max_restarts = 2;
    let run = case.run(|_, _| {});
    assert_eq!(run.got("sink").len(), 50);
    assert_eq!(state_of(&run, "results"), State::GivenUp);
    assert!(run.outcome().is_degraded());
}

#[test]
fn a_run_continues_with_the_remaining_views() {
    let mut case = Case::new(
        Delivery::Realtime,
        &[
            ("view-0", "fail 1", Role::Redundant),
            ("view-1", "idle", Role::Redundant),
        ],
    );
    case.plan.policy.max_restarts = 1;
    let run = case.run(|_, _| {});
    assert_eq!(state_of(&run, "view-0"), State::GivenUp);
    assert_eq!(state_of(&run, "view-1"), State::Finished);
}

#[test]
fn a_process_that_waits_for_a_view_that_was_given_up_does_not_block_the_end() {
    let mut case = Case::new(
        Delivery::Realtime,
        &[
            ("sink", "receive 0", Role::Essential),
            ("source", "fail 1", Role::Redundant),
            ("other-view", "idle", Role::Redundant),
        ],
    );
    case.plan.policy.max_restarts = 1;
    let run = case.run(|_, _| {});
    assert_eq!(state_of(&run, "source"), State::GivenUp);
    assert_eq!(state_of(&run, "sink"), State::Stopped);
}

#[test]
fn a_process_that_missed_the_end_of_stream_does_not_block_the_end() {
    let case = Case::new(
        Delivery::Realtime,
        &[
            ("sink", "die-at-end", Role::Essential),
            ("source", "send-and-leave 20 1 1", Role::Essential),
        ],
    );
    let run = case.run(|_, _| {});
    assert_eq!(run.deaths("sink"), [KILLED]);
    assert_eq!(state_of(&run, "source"), State::Finished);
    assert_eq!(state_of(&run, "sink"), State::Stopped);
    assert!(run.outcome().is_degraded() && !run.outcome().interrupted);
}

#[test]
fn a_process_that_waits_for_a_lost_view_is_not_taken_for_idle() {
    let sink = ("sink", "wait-for-view 4000", Role::Essential);
    let source = ("source", "leave", Role::Essential);
    let run = Case::new(Delivery::Realtime, &[sink, source]).run(|_, _| {});
    assert_eq!(run.got("sink"), [(0, 1)]);
    assert_eq!(state_of(&run, "sink"), State::Finished);
}

#[test]
fn a_run_without_any_view_left_fails() {
    let mut case = Case::new(
        Delivery::Realtime,
        &[
            ("view-0", "fail 1", Role::Redundant),
            ("view-1", "fail 1", Role::Redundant),
        ],
    );
    case.plan.policy.max_restarts = 1;
    let error = case.run(|_, _| {}).result.unwrap_err();
    assert!(matches!(error, SuperviseError::GivenUp { .. }), "{error}");
}

#[test]
fn a_process_that_never_starts_its_main_loop_is_killed() {
    let mut case = Case::new(Delivery::Realtime, &[("mute", "idle", Role::Essential)]);
    // This program runs, but sends no heartbeat.
    case.plan.executable = "/bin/sleep".into();
    case.plan.policy.startup_limit = Duration::from_millis(200);
    case.plan.policy.max_restarts = 0;
    let script = tempfile::Builder::new().prefix("px").tempdir().unwrap();
    let path = script.path().join("mute");
    std::fs::write(&path, "#!/bin/sh\nexec sleep 600\n").unwrap();
    let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o700);
    std::fs::set_permissions(&path, permissions).unwrap();
    case.plan.executable = path;
    let error = case.run(|_, _| {}).result.unwrap_err();
    let SuperviseError::GivenUp { death, .. } = &error else {
        panic!("{error}");
    };
    assert!(matches!(death, Death::NeverBegan { .. }), "{error}");
}

#[test]
fn processes_end_with_a_killed_supervisor_and_the_next_run_cleans_up() {
    let case = Case::new(Delivery::Realtime, &[("only", "idle", Role::Essential)]);
    let mut supervisor = Command::new(&case.plan.executable)
        .arg("supervise")
        .arg(case.base())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(supervisor.stdout.take().unwrap()).lines();
    let pids: Vec<u32> = (0..2).map(|_| lines.next().unwrap().unwrap().parse().unwrap()).collect();
    // Both processes have started, because their files exist.
    assert!(pids.iter().all(|&pid| is_alive(pid)), "{pids:?}");
    supervisor.kill().unwrap();
    supervisor.wait().unwrap();
    case.run(|_, _| {}).outcome();
    assert!(!pids.iter().any(|&pid| is_alive(pid)), "{pids:?}");
}

#[test]
fn full_shared_memory_is_an_error_with_the_numbers_instead_of_sigbus() {
    let base = tempfile::Builder::new().prefix("px").tempdir().unwrap();
    // Mounts a file system of 8 megabytes for this process only.
    let script = format!(
        "mount -t tmpfs -o size=8m tmpfs /dev/shm || exit 99; exec {} fill {}",
        env!("CARGO_BIN_EXE_supervise-dummy"),
        base.path().display()
    );
    let unshared = Command::new("unshare").args(["-m", "sh", "-c", &script]).output();
    let Ok(output) = unshared else {
        eprintln!("skipped: unshare is absent");
        return;
    };
    if !matches!(output.status.code(), Some(0..=98)) && output.status.signal().is_none() {
        eprintln!("skipped: no private file system may be mounted here");
        return;
    }
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(output.status.success(), "{:?}: {lines:?}", output.status);
    assert_eq!(lines.len(), 2, "{lines:?}");
    assert!(
        lines[0].contains("needs 5") && lines[0].contains("8 MB are free"),
        "{}",
        lines[0]
    );
    assert!(
        lines[1].contains("needs 4") && lines[1].contains("are free in /dev/shm"),
        "{}",
        lines[1]
    );
}
