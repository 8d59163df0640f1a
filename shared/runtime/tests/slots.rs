//! What a killed process held is given back, also where several clean up at once, or were killed while they did.
//!
//! This executable is also the processes that are killed, so it has no harness.
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
use messages::ViewQuality;
use runtime::{Bus, Cleaner, Delivery, Limits, Namespace, Stop, TopicPlan};
use rustix::fs::{FlockOperation, fcntl_lock};

const TOPIC: &str = "small";

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("role:sender") => sender(),
        Some("role:cleaner") => cleaner(),
        Some("role:in-vain") => a_slot_is_free_again_however_often_its_clean_up_was_in_vain(),
        Some("role:unfinished") => {
            a_slot_is_free_again_although_its_owner_left_something_unfinished();
        }
        // One process cleans up in one deployment only, as a supervisor does.
        _ => ["role:in-vain", "role:unfinished"]
            .into_iter()
            .for_each(passes),
    }
}

fn passes(test: &str) {
    let mut command = Command::new(std::env::current_exe().unwrap());
    let status = command.arg(test).status().unwrap();
    assert!(status.success(), "{test}: {status}");
}

fn a_slot_is_free_again_however_often_its_clean_up_was_in_vain() {
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
        assert_eq!(cleaner.clean(&bus), 0, "another process is at it");
    }
    kill(&mut other);
    assert_eq!(cleaner.clean(&bus), 1);
    bus.publisher::<ViewQuality>(TOPIC).unwrap();
}

fn a_slot_is_free_again_although_its_owner_left_something_unfinished() {
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

/// A deployment with one topic, which has room for one sender.
fn deployment() -> (Deployment, Bus) {
    let limits = Limits::new(1, 1, 1);
    let plan = TopicPlan::messages::<ViewQuality>(TOPIC.to_owned(), Delivery::Realtime, limits);
    let deployment = Deployment::new(&[plan]);
    let bus = deployment.bus("observer");
    (deployment, bus)
}

/// The folder in which iceoryx2 keeps what a process held that was then killed.
fn killed_sender(deployment: &Deployment) -> PathBuf {
    let namespace = deployment.namespace();
    let nodes = namespace.root().join("nodes");
    let before = folders(&nodes);
    let mut sender = child(
        "role:sender",
        &[namespace.base(), Path::new(namespace.name())],
    );
    let mut new = folders(&nodes);
    new.retain(|it| !before.contains(it));
    kill(&mut sender);
    assert_eq!(new.len(), 1, "{new:?}");
    new.remove(0)
}

fn folders(nodes: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(nodes).unwrap();
    let paths = entries.map(|it| it.unwrap().path());
    paths.filter(|it| it.is_dir()).collect()
}

/// Starts this executable as another process, and waits until that holds what it is to hold.
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

/// Holds the lock that iceoryx2 takes on a dead node that it cleans up.
fn cleaner() {
    let path = std::env::args_os().nth(2).unwrap();
    let file = File::options().read(true).write(true).open(path).unwrap();
    fcntl_lock(&file, FlockOperation::NonBlockingLockExclusive).unwrap();
    wait_to_be_killed();
}

#[expect(clippy::print_stdout, reason = "who started this process reads it")]
fn wait_to_be_killed() {
    println!("ready");
    // Longer than the test takes; nobody is left behind if that fails.
    sleep(Duration::from_mins(1));
}
