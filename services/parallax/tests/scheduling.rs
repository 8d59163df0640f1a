//! Tests of cores, priorities and locked memory: settings are applied if permitted, and otherwise reported.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

use crate::common;

use std::fs;
use std::process::{Command, Output};

use common::{Case, PACED};

/// Returns a value from `/proc/PID/status`.
fn status_of(pid: u32, key: &str) -> String {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    line.unwrap().trim().to_owned()
}

#[test]
fn processes_run_on_their_configured_cores() {
    let cores = runtime::own_cores().unwrap();
    let (first, last) = (cores[0], cores[cores.len() - 1]);
    let text = format!(
        "{PACED}[runtime]\nspin = true\ncores = {{ pose = [{first}], pose-1 = [{last}], results = [{last}] }}\n"
    );
    let case = Case::new("cores", &[80; 2], &text);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    for (process, core) in [("pose-0", first), ("pose-1", last), ("results", last)] {
        let pid = started.pid_of(process);
        // The process logs this before anything else.
        let expected = core.to_string();
        started.until(process, |_| {
            status_of(pid, "Cpus_allowed_list:") == expected
        });
    }
    let ended = started.wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    assert!(
        !ended.stderr.contains("continuing without this setting"),
        "{}",
        ended.stderr
    );
}

#[test]
fn a_dry_run_shows_cores_and_priority_of_every_process() {
    let more = "[runtime]\nspin = true\ncores = { fuse = [0, 9999] }\n";
    let case = Case::new("shown", &[2; 3], more);
    case.start(&["run", "deployment.toml", "--dry-run"])
        .wait()
        .ends(3)
        .says("`runtime.cores` is 9999");
    case.edit("deployment.toml", "9999", "1000");
    let ended = case.start(&["run", "deployment.toml", "--dry-run"]).wait().ends(0);
    let lines: Vec<Vec<&str>> =
        ended.stdout.lines().map(|line| line.split_whitespace().collect()).collect();
    for expected in [
        &["pose-0", "spin"][..],
        &["fuse-0", "cores=0", "spin"],
        &["capture-0"],
    ] {
        assert!(
            lines.contains(&expected.to_vec()),
            "{expected:?}: {lines:?}"
        );
    }
    let warning = "fuse-0: cannot run on cores 0,1000:";
    assert_eq!(ended.stderr.matches(warning).count(), 1, "{}", ended.stderr);
}

#[test]
fn an_unknown_process_is_refused_by_name() {
    let case = Case::new(
        "unknown",
        &[2; 2],
        "[runtime]\npriority = { pose-2 = 10 }\n",
    );
    case.start(&["run", "deployment.toml", "--dry-run"])
        .wait()
        .ends(3)
        .says("`runtime.priority` is \"pose-2\"");
}

/// Runs the deployment without the privileges for real-time priority and locked memory. Returns `None` if this is impossible.
fn without_rights(case: &Case) -> Option<Output> {
    let limits = ["--rtprio=0", "--memlock=65536:65536"];
    let program = common::started::parallax();
    let parallax = [program.to_str().unwrap(), "run", "deployment.toml"];
    // Limits do not apply to root, unless these capabilities are dropped too.
    let drop = ["setpriv", "--bounding-set=-sys_nice,-ipc_lock"];
    let drop = [&drop[..], &["--inh-caps=-sys_nice,-ipc_lock"]].concat();
    let is_owner = status_of(std::process::id(), "Uid:").starts_with('0');
    let drop = if is_owner { drop } else { Vec::new() };
    let words = [&limits[..], &drop, &parallax].concat();
    let mut command = Command::new("prlimit");
    let output = command.current_dir(case.folder()).args(words).output().ok()?;
    let stderr = String::from_utf8_lossy(&output.stderr);
    let is_tool = ["prlimit:", "setpriv:"].iter().any(|name| stderr.starts_with(name));
    (!is_tool).then_some(output)
}

#[test]
fn missing_privileges_are_reported_once_with_a_remedy_and_the_run_continues() {
    let more = "[results]\noverlay_every = 0\n[capture]\nupright = false\n\
                [runtime]\nlock_memory = true\npriority = { pose = 50, triangulate = 50 }\n";
    let case = Case::new("rights", &[4; 2], more);
    let Some(output) = without_rights(&case) else {
        eprintln!("skipped: rights cannot be given up here");
        return;
    };
    case.assert_nothing_left();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    for words in [
        "triangulate, pose-0, pose-1: cannot run at real-time priority 50 (SCHED_FIFO)",
        "cannot lock memory beyond 65536 bytes",
        "ulimit -r",
        "ulimit -l",
    ] {
        assert_eq!(stderr.matches(words).count(), 1, "{words}: {stderr}");
    }
}
