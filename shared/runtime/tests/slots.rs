//! Tests that the slots of a killed process are released, even if several processes clean up at once or are killed during the clean-up.
//!
//! This executable also runs as the processes that are killed, so it has no test harness.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs::{self, File};
use std::io::{BufRead as _, BufReader};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use common::{Deployment, shared_memory};
use failure::Stop;
use messages::ViewQuality;
use runtime::{Bus, Cleaner, Delivery, Limits, Namespace, TopicPlan};
use rustix::fs::{FlockOperation, fcntl_lock};

const TOPIC: &str = "small";

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("role:sender") => sender(),
        Some("role:cleaner") => cleaner(),
        Some("role:in-vain") => a_slot_is_released_after_failed_clean_ups(),
        Some("role:unfinished") => {
            a_slot_is_released_if_its_owner_left_incomplete_files();
        }
        // Each process cleans up in only one deployment, as a supervisor does.
        _ => ["role:in-vain", "role:unfinished"].into_iter().for_each(passes),
    }
}

fn passes(test: &str) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    let status = command.arg(test).status().unwrap();
    assert!(status.success(), "{test}: {status}");
}

fn a_slot_is_released_after_failed_clean_ups() {
    let (deployment, bus) = deployment();
    let node = killed_sender(&deployment);
    let lock = node.with_file_name(format!(
        "{}{}.node_monitor_owner_lock",
        deployment.namespace().prefix(),
        node.file_name().unwrap().display()
    ));
    let mut other = child("role:cleaner", &[&lock]);
    let mut cleaner = Cleaner::default();
    for _ in 0..3 {
        assert_eq!(cleaner.clean(&bus), 0, "another process holds the lock");
    }
    kill(&mut other);
    assert_eq!(cleaner.clean(&bus), 1);
    bus.publisher::<ViewQuality>(TOPIC).unwrap();
}

fn a_slot_is_released_if_its_owner_left_incomplete_files() {
    let (deployment, bus) = deployment();
    let node = killed_sender(&deployment);
    let tag = node.join(format!("{}17.port_tag", deployment.namespace().prefix()));
    fs::write(&tag, "").unwrap();
    fs::set_permissions(&tag, fs::Permissions::from_mode(0o600)).unwrap();
    let mut cleaner = Cleaner::default();
    let cleaned: usize = (0..3).map(|_| cleaner.clean(&bus)).sum();
    assert_eq!(cleaned, 1);
    assert!(!node.exists());
    bus.publisher::<ViewQuality>(TOPIC).unwrap();
    let namespace = deployment.namespace().clone();
    drop((bus, deployment));
    assert_eq!(shared_memory(&namespace), Vec::<String>::new());
}

/// Returns a deployment with one topic, which allows one publisher.
fn deployment() -> (Deployment, Bus) {
    let limits = Limits::new(1, 1, 1);
    let plan = TopicPlan::messages::<ViewQuality>(TOPIC.to_owned(), Delivery::Realtime, limits);
    let deployment = Deployment::new(&[plan]);
    let bus = deployment.bus("observer");
    (deployment, bus)
}

/// Returns the folder of iceoryx2 with the tags of a killed process.
fn killed_sender(deployment: &Deployment) -> PathBuf {
    let namespace = deployment.namespace();
    let nodes = namespace.root().join("nodes");
    let before = folders(&nodes);
    let mut sender = child(
        "role:sender",
        &[namespace.base(), Path::new(namespace.name())],
    );
    let mut new = folders(&nodes);
    new.retain(|folder| !before.contains(folder));
    kill(&mut sender);
    assert_eq!(new.len(), 1, "{new:?}");
    new.remove(0)
}

fn folders(nodes: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(nodes).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.is_dir()).collect()
}

/// Starts this executable as another process, and waits until it is ready.
fn child(role: &str, arguments: &[&Path]) -> Child {
    let mut child = Command::new(std::env::current_exe().unwrap())
        .arg(role)
        .args(arguments)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    let output = child.stdout.as_mut().unwrap();
    BufReader::new(output).read_line(&mut line).unwrap();
    assert_eq!(line, "ready\n");
    child
}

fn kill(child: &mut Child) {
    child.kill().unwrap();
    child.wait().unwrap();
}

fn sender() {
    let mut arguments = std::env::args_os().skip(2);
    let base = PathBuf::from(arguments.next().unwrap());
    let name = arguments.next().unwrap();
    let namespace = Namespace::below(name.to_str().unwrap(), &base).unwrap();
    let bus = Bus::open(&namespace, "sender", &Stop::new().unwrap()).unwrap();
    let _publisher = bus.publisher::<ViewQuality>(TOPIC).unwrap();
    wait_to_be_killed();
}

/// Holds the lock that iceoryx2 takes to clean up a dead node.
fn cleaner() {
    let path = std::env::args_os().nth(2).unwrap();
    let file = File::options().read(true).write(true).open(path).unwrap();
    fcntl_lock(&file, FlockOperation::NonBlockingLockExclusive).unwrap();
    wait_to_be_killed();
}

#[expect(clippy::print_stdout, reason = "the parent process reads it")]
fn wait_to_be_killed() {
    println!("ready");
    // The sleep is longer than the test takes; the process ends even if the test fails.
    sleep(Duration::from_mins(1));
}
