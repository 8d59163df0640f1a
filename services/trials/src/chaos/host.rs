//! A deployment of two hosts on this machine, with a fault of the link or of the host with cameras.

use core::time::Duration;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use failure::{ExitKind, Failure, OrFail as _};
use serde_json::{Value, json};

use super::host_fault::HostFault;
use super::options::Options;
use super::relay::Relay;
use super::testbed::Testbed;
use super::verdict::{self, Verdict};
use crate::trial::limit::{at_most, none_of};

/// Duration of the fault.
const FAULT: Duration = Duration::from_secs(3);
/// Longest time until the other host is reported as not answering, in milliseconds. It is reported after 1.2 s without a message, or later
/// if the machine is busy.
const MAX_NOTICED_MS: f64 = 4000.0;
/// Longest time to wait for the other host at the start.
const PATIENCE: Duration = Duration::from_mins(2);
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Name of the host with cameras.
const FAR: &str = "rack";

/// Measurements of a run with a host fault.
#[derive(Debug, Default)]
struct Measured {
    gone_ms: Option<f64>,
    back_ms: Option<f64>,
    /// Views with frames that are not accounted for.
    unaccounted: Vec<String>,
    state: Value,
}

/// Runs the scenario.
pub(super) fn attempt(
    testbed: &Testbed,
    options: &Options,
    fault: HostFault,
) -> Result<Verdict, Failure> {
    let [name, _] = fault.name_and_summary();
    let n_frames = testbed.plan(name, &[])?.resolved().n_frames();
    let output = testbed.output(name);
    inputs::make_folder(&output)?;
    let state = output.join("hosts.json");
    if state.exists() {
        std::fs::remove_file(&state).map_err(|error| failure::in_file(&state, &error))?;
    }
    let desk_port = free_port().or_fail(ExitKind::Run)?;
    let relay = Relay::to(desk_port).or_fail(ExitKind::Run)?;
    let desk_file = write(testbed, "desk", desk_port)?;
    let far_file = write(testbed, FAR, relay.port())?;
    let mut desk = Running(start(testbed, &desk_file, "desk", &output)?);
    let mut far = Running(start(testbed, &far_file, FAR, &output)?);
    let watch = Watch { testbed, state };
    let mut measured = Measured::default();
    if watch.until(PATIENCE, |state| n_used(state) > 2).is_some() {
        match fault {
            HostFault::Cut => relay.cut(true),
            HostFault::Kill => far.end(),
        }
        let begin = Instant::now();
        let ms = |since: Instant| since.elapsed().as_secs_f64() * 1e3;
        let is_gone = |value: &Value| value["hosts"][0]["there"] == false;
        measured.gone_ms = watch.until(FAULT * 2, is_gone).map(|_| ms(begin));
        std::thread::sleep(FAULT.saturating_sub(begin.elapsed()));
        let before = watch.read().map_or(0, |watch| n_used(&watch));
        match fault {
            HostFault::Cut => relay.cut(false),
            HostFault::Kill => far = Running(start(testbed, &far_file, FAR, &output)?),
        }
        let restored = Instant::now();
        let is_back = |value: &Value| n_used(value) > before + 1;
        measured.back_ms = watch.until(PATIENCE, is_back).map(|_| ms(restored));
    }
    desk.0.wait().or_fail(ExitKind::Run)?;
    far.end();
    measured.state = watch.read().unwrap_or_default();
    measured.unaccounted = unaccounted(&measured.state, n_frames);
    Ok(verdict(name, options, measured))
}

fn verdict(name: &str, options: &Options, measured: Measured) -> Verdict {
    let Measured {
        gone_ms,
        back_ms,
        unaccounted,
        state,
    } = measured;
    Verdict {
        scenario: name.to_owned(),
        measured: format!(
            "noticed: {}, back: {}",
            verdict::ms(gone_ms),
            verdict::ms(back_ms)
        ),
        details: Vec::new(),
        numbers: json!({ "noticed_ms": gone_ms, "back_ms": back_ms, "hosts": state }),
        limits: vec![
            at_most("time until noticed, ms", MAX_NOTICED_MS, gone_ms),
            at_most("time until back, ms", options.limits.max_return_ms, back_ms),
            none_of("views with frames unaccounted for", &unaccounted),
        ],
        run: Value::Null,
    }
}

/// The run of a host, which ends when this value is dropped.
struct Running(Child);

impl Running {
    /// Kills the run. The processes of the run end with it.
    fn end(&mut self) {
        let ended = self.0.kill().and_then(|()| self.0.wait());
        if let Err(error) = ended {
            tracing::debug!(%error, "the host had already ended");
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.end();
    }
}

struct Watch<'a> {
    testbed: &'a Testbed,
    /// File with the state of the hosts.
    state: PathBuf,
}

impl Watch<'_> {
    fn read(&self) -> Option<Value> {
        serde_json::from_str(&std::fs::read_to_string(&self.state).ok()?).ok()
    }

    /// Waits until the state of the hosts satisfies `is_so`. Returns `None` if this takes longer than `limit`.
    fn until(&self, limit: Duration, is_so: impl Fn(&Value) -> bool) -> Option<Value> {
        let begin = Instant::now();
        while begin.elapsed() < limit && !self.testbed.stop.is_requested() {
            let state = self.read().unwrap_or_default();
            if is_so(&state) {
                return Some(state);
            }
            if state["over"] == true {
                return None;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        None
    }
}

fn views(state: &Value) -> impl Iterator<Item = &Value> {
    let hosts = state["hosts"].as_array().into_iter().flatten();
    hosts.flat_map(|host| host["views"].as_array().into_iter().flatten())
}

/// Returns the lowest number of used frames of any view of the other host.
fn n_used(state: &Value) -> u64 {
    let used = views(state).filter_map(|view| view["used"].as_u64());
    used.min().unwrap_or(0)
}

/// Returns the views with frames that are not accounted for.
fn unaccounted(state: &Value, n_frames: u64) -> Vec<String> {
    let sum = |view: &Value| {
        let counts = ["used", "late", "gone", "left_out"];
        counts.iter().filter_map(|count| view[count].as_u64()).sum::<u64>()
    };
    let mut odd: Vec<String> = views(state)
        .filter(|view| sum(view) != n_frames)
        .map(|view| format!("view {}: {} of {n_frames}", view["view"], sum(view)))
        .collect();
    if views(state).next().is_none() {
        odd.push("all: hosts.json is missing".to_owned());
    }
    odd
}

fn free_port() -> std::io::Result<u16> {
    Ok(TcpListener::bind(("127.0.0.1", 0))?.local_addr()?.port())
}

/// Writes the deployment file of one of the hosts. The first half of the cameras is connected to the fusing host.
fn write(testbed: &Testbed, host: &str, port: u16) -> Result<PathBuf, Failure> {
    let text = std::fs::read_to_string(&testbed.file)
        .map_err(|error| failure::in_file(&testbed.file, &error))?;
    let plan = testbed.plan(host, &[])?;
    let cameras = &plan.resolved().deployment.cameras;
    let names = |all: &[deployment::capture::Camera]| {
        let quoted = all.iter().map(|camera| toml::Value::from(camera.name.as_str()).to_string());
        quoted.collect::<Vec<_>>().join(", ")
    };
    let (near, far) = cameras.split_at(cameras.len() / 2);
    let text = format!(
        "{text}\n[link]\ninsecure = true     # the link never leaves this machine\n\n[[host]]\nname = \"desk\"\nfuses = true\naddress = \
         \"127.0.0.1:{port}\"\nviews = [{}]\n\n[[host]]\nname = \"{FAR}\"\nviews = [{}]\n",
        names(near),
        names(far)
    );
    let file = testbed.file.with_file_name(format!("hosts-{host}.toml"));
    files::replace(&file, text.as_bytes()).map_err(|error| failure::in_file(&file, &error))?;
    Ok(file)
}

fn start(testbed: &Testbed, file: &Path, host: &str, output: &Path) -> Result<Child, Failure> {
    let mut command = Command::new(std::env::current_exe().or_fail(ExitKind::Run)?);
    command.arg("run").arg(file).args(["--quiet", "--host", host]);
    command.arg("--out").arg(output);
    for pair in testbed.set(&[]) {
        command.arg("--set").arg(pair);
    }
    let command = command.stdin(Stdio::null()).stdout(Stdio::null());
    command.spawn().or_fail(ExitKind::Run)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(used: u64, gone: u64) -> Value {
        let view =
            |view| json!({ "view": view, "used": used, "late": 1, "gone": gone, "left_out": 0 });
        json!({ "hosts": [{ "there": true, "views": [view(2), view(3)] }] })
    }

    #[test]
    fn frames_that_are_not_accounted_for_are_named() {
        assert!(unaccounted(&state(7, 2), 10).is_empty());
        let odd = unaccounted(&state(7, 1), 10);
        assert_eq!(odd, ["view 2: 9 of 10", "view 3: 9 of 10"]);
        assert_eq!(unaccounted(&Value::Null, 10).len(), 1);
        assert_eq!(n_used(&state(7, 2)), 7);
    }
}
