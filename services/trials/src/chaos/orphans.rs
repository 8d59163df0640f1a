//! The supervisor itself is killed: what becomes of its processes, and of the next run.

use core::time::Duration;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use launch::Planned;
use runtime::{ExitKind, Failure, OrFail as _};

use super::census;
use super::ground::Ground;
use super::judge::Orphaned;

/// Results of the first run before its supervisor is killed.
const RESULTS: usize = 3;
/// How long they may take.
const PATIENCE: Duration = Duration::from_mins(1);
/// How long its processes are waited for.
const MOURNING: Duration = Duration::from_secs(10);
const TURN: Duration = Duration::from_millis(5);

/// Runs the deployment as a process of its own until it gives results, and kills that.
///
/// * `planned`: the same deployment.
///
/// # Errors
///
/// It cannot be started, or ends or gives no results by itself.
pub(super) fn kill(
    ground: &Ground,
    scenario: &str,
    planned: &Planned,
) -> Result<Orphaned, Failure> {
    let output = ground.output(scenario);
    let results = output.join("pose3d.jsonl.part");
    if results.exists() {
        fs::remove_file(&results).map_err(|error| runtime::in_file(&results, &error))?;
    }
    let mut command = Command::new(std::env::current_exe().or_fail(ExitKind::Run)?);
    command
        .arg("run")
        .arg(&ground.file)
        .arg("--out")
        .arg(&output)
        .arg("--quiet");
    for it in ground.set(&[]) {
        command.arg("--set").arg(it);
    }
    let command = command.stdin(Stdio::null()).stdout(Stdio::null());
    let mut supervisor = command.spawn().or_fail(ExitKind::Run)?;
    let outcome = wait_for_results(ground, &mut supervisor, &results);
    let orphans = children(supervisor.id());
    // Whatever happened, it must not be left behind.
    supervisor.kill().or_fail(ExitKind::Run)?;
    let killed = Instant::now();
    supervisor.wait().or_fail(ExitKind::Run)?;
    outcome?;
    while orphans.iter().any(|it| is_alive(*it)) && killed.elapsed() < MOURNING {
        std::thread::sleep(TURN);
    }
    let ended = !orphans.iter().any(|it| is_alive(*it));
    Ok(Orphaned {
        ended_ms: (ended && !orphans.is_empty()).then(|| killed.elapsed().as_secs_f64() * 1000.0),
        files: census::n_files(&planned.plan().namespace),
        result_ms: None,
    })
}

fn wait_for_results(ground: &Ground, supervisor: &mut Child, file: &Path) -> Result<(), Failure> {
    let begin = Instant::now();
    loop {
        let text = fs::read_to_string(file).unwrap_or_default();
        if text.lines().count() >= RESULTS || ground.stop.is_requested() {
            return Ok(());
        }
        if let Some(status) = supervisor.try_wait().or_fail(ExitKind::Run)? {
            let message = format!("the run that was to be killed ended by itself: {status}");
            return Err(Failure::new(ExitKind::Run, message));
        }
        if begin.elapsed() > PATIENCE {
            let message = "the run that was to be killed gave no results";
            return Err(Failure::new(ExitKind::Run, message));
        }
        std::thread::sleep(TURN);
    }
}

/// The processes that a process has started.
fn children(parent: u32) -> BTreeSet<u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let pids = entries.filter_map(|it| it.file_name().to_str()?.parse().ok());
    pids.filter(|it| state(*it).is_some_and(|it| it.1 == parent))
        .collect()
}

/// One that has ended and that nobody has asked after yet is not alive.
fn is_alive(pid: u32) -> bool {
    state(pid).is_some_and(|it| !['Z', 'X'].contains(&it.0))
}

/// What a process does, and who its parent is.
fn state(pid: u32) -> Option<(char, u32)> {
    parse(&fs::read_to_string(format!("/proc/{pid}/stat")).ok()?)
}

/// `17 (a name) S 16 ...`; a name may contain anything.
fn parse(stat: &str) -> Option<(char, u32)> {
    let mut words = stat.rsplit_once(')')?.1.split_whitespace();
    Some((words.next()?.parse().ok()?, words.next()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_is_read_whatever_its_name() {
        assert_eq!(parse("17 (sleep) S 16 1 1"), Some(('S', 16)));
        assert_eq!(parse("17 (a) Z 9 (b) Z 16 1 1"), Some(('Z', 16)));
        assert_eq!(parse("17 sleep S 16"), None);
        assert_eq!(parse("17 (sleep)"), None);
    }

    #[test]
    fn a_child_is_its_parents_and_alive_until_it_is_killed() {
        let mut child = Command::new("sleep").arg("600").spawn().unwrap();
        assert!(children(std::process::id()).contains(&child.id()));
        assert!(is_alive(child.id()));
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(!is_alive(child.id()));
    }
}
