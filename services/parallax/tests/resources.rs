//! Tests of runs for which there is not enough shared memory, not enough file descriptors, or no free name, and of leftovers of other
//! users. Also tests that no network sockets are open.
#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

use crate::common;

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::{MetadataExt as _, chown};

use common::started::processes;
use common::{Case, Ended, PACED, PLAIN, Started};
use runtime::Namespace;
use serde_json::{Value, json};

/// User id of a user who does not run the tests.
const OTHER: u32 = 65_534;

/// Checks that no process of a run was ended by a memory fault.
fn assert_no_bus_error(ended: &Ended) {
    for words in ["signal 7", "SIGBUS", "signal 11", "panic"] {
        assert!(!ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
}

#[test]
fn shared_memory_that_fills_at_the_start_of_a_run_causes_an_error_instead_of_a_signal() {
    let more = PLAIN.to_owned() + "[supervise]\nmax_restarts = 2\ndeadline_ms = 2000\n";
    let case = Case::new("filling", &[20; 3], &more);
    // A second process fills the rest of the shared memory as soon as the supervisor has its lock, and frees it before the next run. This
    // is done five times, and then repeated until the process was fast enough at least once.
    let script = "mount -t tmpfs -o size=64m tmpfs /dev/shm\n\
        n=0\n\
        for wait in 0 1 3 5 8 0 2 0 4 0 6 0 1 0 3 0 5 0 8 0; do\n\
          n=$((n + 1))\n\
          timeout -k 20 100 \"$PARALLAX\" run deployment.toml --force --json >said-$n 2>&1 & run=$!\n\
          while set -- /dev/shm/px*/*/lock; [ ! -e \"$1\" ]; do kill -0 $run; done\n\
          [ $wait = 0 ] || sleep 0.0$wait\n\
          while kill -0 $run 2>/dev/null; do cat /dev/zero >>/dev/shm/filler 2>/dev/null || true; done\n\
          code=0; wait $run || code=$?; echo $code >code-$n\n\
          rm /dev/shm/filler\n\
          if [ $code -ge 124 ]; then break; fi\n\
          if [ $n -ge 5 ] && grep -qx 1 code-*; then break; fi\n\
        done\n\
        exec \"$PARALLAX\" run deployment.toml --force --json";
    let Some(started) = Started::in_mount_namespace(case.folder(), script) else {
        eprintln!("skipped: no private file system may be mounted here");
        return;
    };
    started.wait().ends(0);
    let mut n_refused = 0;
    for nth in (1..).take_while(|nth| case.path(&format!("code-{nth}")).exists()) {
        let read = |name: &str| fs::read_to_string(case.path(&format!("{name}-{nth}"))).unwrap();
        let (said, code) = (read("said"), read("code"));
        for words in ["signal 7", "SIGBUS", "signal 11", "SIGSEGV", "panic"] {
            assert!(!said.contains(words), "{words}: {said}");
        }
        let is_ended = !["124", "137"].contains(&code.trim());
        assert!(is_ended, "it waited for ever: {said}");
        if code.trim() == "1" {
            n_refused += 1;
            let tells = said.contains("free in /dev/shm") && said.contains("make room");
            assert!(tells || said.contains("No space left"), "{said}");
        }
    }
    assert!(n_refused > 0, "it was filled too late");
}

#[test]
fn a_file_that_cannot_grow_is_counted_and_does_not_end_a_process() {
    let case = Case::new("limit", &[60; 2], PACED);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("five frames", |_| case.lines("pose3d.jsonl").len() >= 5);
    let record = started.pid_of("results").to_string();
    // The file is already larger than this limit.
    let limit = "--fsize=1000:1000";
    let set = std::process::Command::new("prlimit").args(["--pid", &record, limit]).status();
    assert!(
        set.is_ok_and(|set| set.success()),
        "prlimit belongs to util-linux"
    );
    let ended = started.wait().ends(7);
    case.assert_nothing_left();
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(report["restarts"], json!([]), "{}", ended.stderr);
    ended.says("os error 27");
}

#[test]
fn a_file_size_limit_is_an_error_with_the_limit() {
    let case = Case::new("small", &[2; 2], PLAIN);
    let script = "ulimit -f 16; exec \"$PARALLAX\" run deployment.toml --force --json";
    let ended = case.start_in_shell(script).wait().ends(1);
    for words in ["error: ", "no file may have more than 8 KB", "ulimit -f"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
    case.assert_nothing_left();
}

#[test]
fn files_of_a_run_are_private_for_any_umask() {
    let case = Case::new(
        "umask",
        &[3; 2],
        &PLAIN.replace("overlay_every = 0", "overlay_every = 1"),
    );
    let script = "umask 0\n\
        if mount -t tmpfs tmpfs /dev/shm 2>/dev/null; then mkdir -m 777 /dev/shm/px-$(id -u); fi\n\
        \"$PARALLAX\" record deployment.toml --out run.mcap --json\n\
        stat -c %a /dev/shm/px-$(id -u) >base";
    let started = Started::in_mount_namespace(case.folder(), script);
    let in_own = started.is_some();
    started.unwrap_or_else(|| case.start_in_shell(script)).wait().ends(0);
    if in_own {
        let mode = fs::read_to_string(case.path("base")).unwrap();
        assert_eq!(mode.trim(), "700", "the directory that was open to all");
    }
    let mut folders = vec![case.path("out")];
    let mut n_files = 0;
    while let Some(path) = folders.pop() {
        let found = fs::symlink_metadata(&path).unwrap();
        assert_eq!(
            found.mode() & 0o077,
            0,
            "{} is open to others",
            path.display()
        );
        if found.is_dir() {
            let inner = fs::read_dir(&path).unwrap();
            folders.extend(inner.map(|inner| inner.unwrap().path()));
        } else {
            n_files += 1;
        }
    }
    assert!(n_files > 8, "{n_files} files");
    let mode = fs::metadata(case.path("run.mcap")).unwrap().mode();
    assert_eq!(mode & 0o077, 0, "{mode:o}");
}

#[test]
fn truncated_shared_memory_is_reported_and_ends_no_process_by_a_signal() {
    let case = Case::new("cut", &[400; 2], PACED);
    let mut started = case.start(&["run", "deployment.toml"]);
    started.until("three frames", |_| case.lines("pose3d.jsonl").len() >= 3);
    let namespace = Namespace::new(&case.name).unwrap();
    for entry in fs::read_dir("/dev/shm").unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if name.starts_with(namespace.prefix()) {
            // A file may disappear during the listing.
            let file = fs::OpenOptions::new().write(true).open(entry.path());
            file.and_then(|file| file.set_len(0)).ok();
        }
    }
    // Usually the run ends at once. It may also wait for a truncated file, and notice this after a minute.
    let ended = started.wait_among_others().ends(1);
    let causes = ["is missing or damaged", "has not answered the supervisor"];
    let said = causes.map(|cause| format!("error: shared memory of the deployment {cause}"));
    let is_said = said.iter().any(|words| ended.stderr.contains(words));
    assert!(
        is_said && ended.stderr.contains("parallax clean"),
        "{}",
        ended.stderr
    );
    case.start(&["clean", &case.name]).wait().ends(0);
    case.assert_nothing_left();
}

#[test]
fn too_few_descriptors_are_refused_with_the_numbers() {
    let case = Case::new("descriptors", &[2; 2], PLAIN);
    let ended = case
        .start_in_shell("ulimit -n 64; exec \"$PARALLAX\" run deployment.toml --force --json")
        .wait();
    case.assert_nothing_left();
    assert_no_bus_error(&ended);
    assert_eq!(ended.status.code(), Some(3), "{}", ended.stderr);
    for words in ["64 open files", "ulimit -n"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
}

#[test]
fn a_second_run_of_the_same_name_is_refused_and_the_first_continues() {
    let case = Case::new("twice", &[60; 2], PACED);
    let mut first = case.start(&["run", "deployment.toml", "--json"]);
    first.until("five frames", |_| case.lines("pose3d.jsonl").len() >= 5);
    let id = first.id();
    let second = case.start(&["run", "deployment.toml", "--json", "--set", "output=other"]);
    let second = second.wait_among_others().ends(1);
    let said = format!("is already running (process {id})");
    second.says(&said);
    first.wait().ends(0);
    case.assert_nothing_left();
}

#[test]
fn leftovers_of_another_user_are_named_with_a_remedy() {
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

/// Returns the sockets of a process, by inode.
fn sockets(pid: u32) -> BTreeSet<String> {
    let entries = fs::read_dir(format!("/proc/{pid}/fd"));
    let links = entries.into_iter().flatten().flatten();
    let links = links.filter_map(|link| fs::read_link(link.path()).ok());
    let inode = |link: std::path::PathBuf| {
        let text = link.to_str()?.strip_prefix("socket:[")?;
        Some(text.strip_suffix(']')?.to_owned())
    };
    links.filter_map(inode).collect()
}

#[test]
fn no_process_of_a_run_has_a_network_socket() {
    let case = Case::new("network", &[60; 2], PACED);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("five frames", |_| case.lines("pose3d.jsonl").len() >= 5);
    let all = processes(case.folder());
    assert_eq!(all.len(), 7, "{all:?}");
    let mut n_sockets = 0;
    let run = u32::try_from(started.id()).unwrap();
    for pid in all.iter().map(|process| process.0).chain([run]) {
        let own = sockets(pid);
        n_sockets += own.len();
        for protocol in [
            "tcp", "tcp6", "udp", "udp6", "raw", "raw6", "packet", "netlink",
        ] {
            let table = fs::read_to_string(format!("/proc/{pid}/net/{protocol}"));
            let table = table.unwrap_or_default();
            let words: BTreeSet<&str> = table.split_ascii_whitespace().collect();
            let open: Vec<_> =
                own.iter().filter(|socket| words.contains(socket.as_str())).collect();
            assert!(open.is_empty(), "process {pid} has a {protocol} socket");
        }
    }
    // The sockets for wake-ups have names in the file system. They show that the listing does find sockets.
    assert!(n_sockets > 10, "{n_sockets}");
    assert_eq!(started.wait().status.code(), Some(0));
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes long"]
    fn shared_memory_that_fills_during_a_run_affects_only_starting_processes() {
        let more = PACED.to_owned() + "[supervise]\nmax_restarts = 2\n";
        let case = Case::new("filled", &[300; 3], &more);
        // The processes are children of the run. One of these processes is killed when there is no space to start another. The space that it
        // frees is filled at once.
        let script = "mount -t tmpfs -o size=64m tmpfs /dev/shm\n\
            \"$PARALLAX\" run deployment.toml --force --json & run=$!\n\
            while [ \"$(cat out/pose3d.jsonl.part 2>/dev/null | wc -l)\" -lt 10 ]; do\n\
              kill -0 $run; sleep 0.05\n\
            done\n\
            cat /dev/zero >/dev/shm/filler 2>/dev/null || true\n\
            stat -f -c %a /dev/shm >free\n\
            while kill -0 $run 2>/dev/null; do\n\
              cat /dev/zero >>/dev/shm/filler 2>/dev/null || true; sleep 0.01\n\
            done & filling=$!\n\
            for dir in /proc/[0-9]*; do\n\
              line=$(tr '\\0' ' ' <$dir/cmdline 2>/dev/null || true)\n\
              case \"$line\" in *\"$PWD\"*\" --index 1\"*) case \"$line\" in\n\
                *\" service pose \"*) kill -9 ${dir#/proc/};; esac;; esac\n\
            done\n\
            code=0; wait $run || code=$?; kill $filling 2>/dev/null || true; exit $code";
        let Some(started) = Started::in_mount_namespace(case.folder(), script) else {
            eprintln!("skipped: no private file system may be mounted here");
            return;
        };
        let ended = started.wait();
        assert_eq!(fs::read_to_string(case.path("free")).unwrap().trim(), "0");
        assert_no_bus_error(&ended);
        assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
        let report: Value = serde_json::from_str(&ended.stdout).unwrap();
        assert_eq!(report["given_up"], json!(["pose-1"]), "{}", ended.stderr);
        // The killed process frees memory, so the next process may fail at different steps: when it requests its queues, a topic, or the
        // wake-up of a topic.
        for words in [
            "of shared memory",
            "free in /dev/shm",
            "make room in /dev/shm",
        ] {
            assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
        }
        for restarted in report["restarts"].as_array().unwrap() {
            assert_eq!(restarted["process"], "pose-1", "{}", ended.stderr);
        }
        let summary = &report["recorded"]["summary"];
        assert_eq!(summary["frames"], json!(300), "{}", ended.stderr);
        assert_eq!(summary["views_present"]["a"], json!(300));
    }
}
