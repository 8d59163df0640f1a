//! Kills the supervisor of a run, and waits for its orphaned processes to end.

use core::time::Duration;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _};
use launch::Planned;

use super::judge::SupervisorKillOutcome;
use super::resources;
use super::testbed::Testbed;

/// Number of results before the supervisor is killed.
const RESULTS: usize = 3;
/// Longest time to wait for these results.
const PATIENCE: Duration = Duration::from_mins(1);
/// Longest time to wait for the orphaned processes to end.
const ORPHAN_PATIENCE: Duration = Duration::from_secs(10);
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Runs `parallax run` in a separate process until there are results, and kills it.
///
/// * `planned`: the plan of the same deployment.
///
/// # Errors
///
/// Fails if the run cannot be started, ends early, or has no results in time.
pub(super) fn kill(
    testbed: &Testbed,
    scenario: &str,
    planned: &Planned,
) -> Result<SupervisorKillOutcome, Failure> {
    let output = testbed.output(scenario);
    let results = output.join("pose3d.jsonl.part");
    if results.exists() {
        fs::remove_file(&results).map_err(|error| failure::in_file(&results, &error))?;
    }
    let mut command = Command::new(std::env::current_exe().or_fail(ExitKind::Run)?);
    command.arg("run").arg(&testbed.file).arg("--out").arg(&output).arg("--quiet");
    for pair in testbed.set(&[]) {
        command.arg("--set").arg(pair);
    }
    let command = command.stdin(Stdio::null()).stdout(Stdio::null());
    let mut supervisor = command.spawn().or_fail(ExitKind::Run)?;
    let outcome = wait_for_results(testbed, &mut supervisor, &results);
    let orphans = children(supervisor.id());
    // The supervisor is killed even after a failure, so that it does not keep running.
    supervisor.kill().or_fail(ExitKind::Run)?;
    let killed = Instant::now();
    supervisor.wait().or_fail(ExitKind::Run)?;
    outcome?;
    while orphans.iter().any(|orphan| is_alive(*orphan)) && killed.elapsed() < ORPHAN_PATIENCE {
        std::thread::sleep(POLL_INTERVAL);
    }
    let ended = !orphans.iter().any(|orphan| is_alive(*orphan));
    Ok(SupervisorKillOutcome {
        ended_ms: (ended && !orphans.is_empty()).then(|| killed.elapsed().as_secs_f64() * 1000.0),
        files: resources::n_files(&planned.plan().namespace),
        result_ms: None,
    })
}

fn wait_for_results(testbed: &Testbed, supervisor: &mut Child, file: &Path) -> Result<(), Failure> {
    let begin = Instant::now();
    loop {
        let text = fs::read_to_string(file).unwrap_or_default();
        if text.lines().count() >= RESULTS || testbed.stop.is_requested() {
            return Ok(());
        }
        if let Some(status) = supervisor.try_wait().or_fail(ExitKind::Run)? {
            let message = format!("the run ended before it could be killed: {status}");
            return Err(Failure::new(ExitKind::Run, message));
        }
        if begin.elapsed() > PATIENCE {
            let message = "the run that should be killed gave no results";
            return Err(Failure::new(ExitKind::Run, message));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Returns the child processes of a process.
fn children(parent: u32) -> BTreeSet<u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter(|pid| state(*pid).is_some_and(|state| state.1 == parent)).collect()
}

/// Returns true if a process runs; a zombie process does not count.
fn is_alive(pid: u32) -> bool {
    state(pid).is_some_and(|state| !['Z', 'X'].contains(&state.0))
}

/// Returns the state and the parent of a process.
fn state(pid: u32) -> Option<(char, u32)> {
    parse(&fs::read_to_string(format!("/proc/{pid}/stat")).ok()?)
}

/// Parses state and parent from `/proc/PID/stat`: `17 (a name) S 16 ...`. The name may contain any character.
fn parse(stat: &str) -> Option<(char, u32)> {
    let mut words = stat.rsplit_once(')')?.1.split_whitespace();
    Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_process_may_contain_any_character() {
        assert_eq!(parse("17 (sleep) S 16 1 1"), Some(('S', 16)));
        assert_eq!(parse("17 (a) Z 9 (b) Z 16 1 1"), Some(('Z', 16)));
        assert_eq!(parse("17 sleep S 16"), None);
        assert_eq!(parse("17 (sleep)"), None);
    }

    #[test]
    fn a_child_is_found_and_is_alive_until_it_is_killed() {
        let mut child = Command::new("sleep").arg("600").spawn().unwrap();
        assert!(children(std::process::id()).contains(&child.id()));
        assert!(is_alive(child.id()));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!is_alive(child.id()));
    }
}
