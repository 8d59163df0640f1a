//! Tests of other programs that read a running deployment: with `client`, by datagrams, and from Python.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use core::time::Duration;
use std::collections::BTreeSet;
use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use client::{Client, ClientError, State, Wish};
use common::started::WATCHDOG;
use common::started::signal;
use common::{Case, PACED, PLAIN};
use runtime::GuestError;
use serde_json::Value;

use crate::common;

/// Returns the next moment.
fn next(client: &mut Client) -> client::Moment {
    let moment = client.next(WATCHDOG).unwrap();
    assert!(moment.is_some(), "nothing came");
    moment.unwrap()
}

/// Waits until a condition is true.
fn until(mut holds: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < WATCHDOG, "waited in vain");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Returns the file that is mapped at some bytes of this process.
fn mapped_file(bytes: &[u8]) -> String {
    let at = bytes.as_ptr().addr();
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap();
    let of_line = |line: &str| {
        let (range, _) = line.split_once(' ')?;
        let (begin, end) = range.split_once('-')?;
        let [begin, end] = [begin, end].map(|address| usize::from_str_radix(address, 16));
        (begin.ok()?..end.ok()?).contains(&at).then(|| line.to_owned())
    };
    let line = maps.lines().find_map(of_line).unwrap_or_default();
    line.split_ascii_whitespace().nth(5).unwrap_or_default().to_owned()
}

#[test]
fn a_client_receives_from_a_restarted_process_and_does_not_keep_a_run_from_ending() {
    let live = PACED.replace("\"paced\"", "\"realtime\"");
    let case = Case::new("client", &[160; 2], &live);
    let wish = Wish::skeletons().with_poses().with_pictures().every_frame(64);
    // The deployment does not exist yet.
    let refused = Client::open(&case.name, &wish).unwrap_err();
    assert!(refused.is_not_running(), "{refused}");
    let mut client = Client::wait_for(&case.name, &wish).unwrap();
    assert_eq!(client.state(), State::Waiting);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    let first = next(&mut client);
    assert_eq!(first.running.name, case.name);
    let refused = Client::open(
        &case.name,
        &Wish::views().with_poses().of_cameras(&["none"]),
    );
    let refused = refused.unwrap_err();
    assert!(matches!(refused, ClientError::NoCamera { .. }), "{refused}");
    let moment = loop {
        let moment = next(&mut client);
        if moment.is_complete {
            break moment;
        }
    };
    assert_eq!(moment.views.len(), 2);
    for view in &moment.views {
        let picture = view.picture.as_ref().unwrap();
        let [width, height] = picture.size();
        assert_eq!(picture.pixels().len() as u32, width * height * 3);
        assert_eq!(view.pose.as_ref().unwrap().stamp.frame, moment.frame);
    }
    signal("KILL", started.pid_of("triangulate").into());
    until(|| {
        let moment = next(&mut client);
        moment.skeletons.is_some_and(|skeletons| skeletons.message().stamp.epoch == 1)
    });
    // The run ends and removes its files while the client is connected.
    let ended = started.wait();
    // A process was lost during the run.
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    case.assert_nothing_left();
    until(|| client.state() == State::Waiting);
    assert_eq!(client.losses().refused, 0);
}

#[test]
fn a_sleeping_client_does_not_affect_a_lossless_run() {
    // The run is longer than a client may need to join on a loaded machine.
    let case = Case::new("asleep", &[160; 2], PACED);
    // This client holds a picture of each view, and never reads another picture.
    let mut asleep = Client::wait_for(&case.name, &Wish::views().with_pictures()).unwrap();
    let started = case.start(&["run", "deployment.toml", "--json"]);
    let held = loop {
        let moment = next(&mut asleep);
        if moment.is_complete {
            break moment;
        }
    };
    let prefix = runtime::Namespace::new(&case.name).unwrap();
    let pictures = || held.views.iter().filter_map(|view| view.picture.as_ref());
    assert_eq!(pictures().count(), 2);
    for picture in pictures() {
        assert!(picture.is_in_place());
        let file = mapped_file(picture.pixels());
        assert!(
            file.contains(prefix.prefix()) && file.starts_with("/dev/shm/"),
            "{file}"
        );
    }
    let pixels = || pictures().map(|picture| picture.pixels().to_vec()).collect::<Vec<_>>();
    let before = pixels();
    let so_far = case.lines("pose3d.jsonl").len();
    until(|| case.lines("pose3d.jsonl").len() > so_far + 25);
    // The held pictures were not overwritten.
    assert!(before == pixels());
    drop(held);
    started.wait().ends(0);
    let lines = case.lines("pose3d.jsonl");
    assert_eq!(lines.len(), 160);
    assert!(lines.iter().all(|line| line["views_missing"] == serde_json::json!({})));
    case.assert_nothing_left();
}

#[test]
fn the_number_of_clients_is_limited_to_the_number_of_places() {
    let case = Case::new("full", &[400; 2], PACED);
    let wish = Wish::skeletons();
    let mut clients = vec![Client::wait_for(&case.name, &wish).unwrap()];
    let started = case.start(&["run", "deployment.toml"]);
    next(&mut clients[0]);
    let refused = loop {
        match Client::open(&case.name, &wish) {
            Ok(client) => clients.push(client),
            Err(error) => break error,
        }
        assert!(clients.len() < 20);
    };
    assert_eq!(clients.len(), runtime::MOST_GUESTS);
    let is_full = matches!(&refused, ClientError::Guest(GuestError::Full { guests, .. }) if guests.len() == 4);
    assert!(is_full, "{refused}");
    clients.pop();
    clients.push(Client::open(&case.name, &wish).unwrap());
    signal("INT", started.id());
    started.wait();
    case.assert_nothing_left();
}

#[test]
fn a_client_gets_no_error_from_a_series_of_short_runs() {
    let case = Case::new("across", &[4; 2], PLAIN);
    let wish = Wish::skeletons().with_poses().every_frame(64);
    let mut client = Client::wait_for(&case.name, &wish).unwrap();
    let is_ended = Arc::new(AtomicBool::new(false));
    let ended = Arc::clone(&is_ended);
    let listening = std::thread::Builder::new()
        .name("listening".to_owned())
        .spawn(move || {
            // The client need not join in time. A deployment that starts or ends while the client joins is not an error.
            while !ended.load(Ordering::Relaxed) {
                client.next(Duration::from_millis(50)).unwrap();
            }
            client.losses().refused
        })
        .unwrap();
    for _ in 0..5 {
        case.start(&["run", "deployment.toml", "--json"]).wait().ends(0);
    }
    is_ended.store(true, Ordering::Relaxed);
    assert_eq!(listening.join().unwrap(), 0);
    case.assert_nothing_left();
}

#[test]
fn datagrams_contain_the_joints_and_sending_them_does_not_change_the_run() {
    let case = Case::new("publish", &[120; 2], PACED);
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(WATCHDOG)).unwrap();
    let port = socket.local_addr().unwrap().port();
    let target = format!("udp://127.0.0.1:{port}");
    case.start(&["run", "deployment.toml", "--publish", "udp://192.0.2.1:9"])
        .wait()
        .ends(2)
        .says("--beyond-this-machine");
    // No program listens on the other port.
    let arguments = [
        "run",
        "deployment.toml",
        "--json",
        "--publish",
        &target,
        "--publish",
        "osc://127.0.0.1:9",
    ];
    let started = case.start(&arguments);
    let mut frames = BTreeSet::new();
    let mut datagram = [0; 2000];
    while frames.len() < 5 {
        let n = socket.recv(&mut datagram).unwrap();
        assert!(n <= client::publish::MOST_BYTES);
        let value: Value = serde_json::from_slice(&datagram[..n]).unwrap();
        assert_eq!(value["deployment"], case.name);
        for joint in value["joints"].as_object().unwrap().values() {
            assert!(
                joint.is_string() || joint.as_array().is_some_and(|array| array.len() == 4),
                "{joint}"
            );
        }
        frames.insert(value["frame"].as_u64().unwrap());
    }
    let ended = started.wait().ends(0);
    assert!(
        ended.stderr.contains("publish: ") && ended.stderr.contains("publishing the skeletons"),
        "{}",
        ended.stderr
    );
    case.assert_nothing_left();
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    #![expect(clippy::print_stderr, reason = "what is skipped is told")]

    use std::path::Path;
    use std::process::Command;

    /// Returns true if a Python installation has everything that the Python tests need.
    fn is_able(python: &str) -> bool {
        let imports = Command::new(python).args(["-c", "import iceoryx2, numpy, pytest"]).output();
        imports.is_ok_and(|import| import.status.success())
    }

    #[test]
    #[ignore = "takes long"]
    fn the_python_package_reads_a_real_deployment() {
        let python = "python3";
        if !is_able(python) {
            eprintln!("skipped: {python} has no iceoryx2, numpy and pytest");
            return;
        }
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../python");
        let run = Command::new(python)
            .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
            .current_dir(folder)
            .env("PARALLAX", crate::common::started::parallax())
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .output();
        let run = run.unwrap();
        let said = String::from_utf8_lossy(&run.stdout).into_owned();
        assert!(run.status.success(), "{said}");
    }
}
