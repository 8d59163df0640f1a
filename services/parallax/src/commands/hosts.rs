//! `parallax hosts`: shows the state of a deployment on several machines, and creates its keys.

use core::fmt::Write as _;
use core::time::Duration;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::{Command as Program, ExitCode};

use clap::{Args, Subcommand};
use deployment::Deployment;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::{Resolved, hosts, load, plan};
use serde_json::Value;
use terminal::output;

/// Time that `status` waits for the fusing host.
const PATIENCE: Duration = Duration::from_secs(5);

/// The subcommands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show the hosts of a running deployment: which of them answer, the accuracy of their clocks, and the counts of every view's frames.
    Status(StatusArguments),
    /// Create the keys of all hosts: a certificate authority, and a certificate with its key for each host.
    Keys(KeysArguments),
}

/// Options of `parallax hosts status`.
#[derive(Debug, Args)]
#[command(after_help = "\
The command asks the fusing host over the network, so it works on every host that has keys.

Exit codes: 0 all hosts answer; 7 some hosts do not answer; 4 the fusing host does not answer.

Examples:
    parallax hosts status my.toml
    parallax hosts status my.toml --host left --json")]
pub(crate) struct StatusArguments {
    /// The deployment file.
    config: PathBuf,
    /// Name of this machine in the deployment. If not given, the host name of this machine.
    #[arg(long, value_name = "NAME")]
    host: Option<String>,
    /// Print the state as JSON.
    #[arg(long)]
    json: bool,
}

/// Options of `parallax hosts keys`.
#[derive(Debug, Args)]
#[command(after_help = "\
Writes ca.pem, ca.key, and HOST.pem and HOST.key for every host into the folder `link.keys` of the deployment. In that folder, every \
host needs ca.pem and its own two files. ca.key is only needed to add hosts later; do not copy it to any host. Existing files are not \
replaced.

Example:
    parallax hosts keys my.toml")]
pub(crate) struct KeysArguments {
    /// The deployment file.
    config: PathBuf,
}

/// Runs a command.
pub(crate) fn run(command: &Command) -> Result<ExitCode, Failure> {
    match command {
        Command::Status(it) => status(it),
        Command::Keys(it) => keys(it),
    }
}

/// Resolves what this machine runs: a whole deployment, or the part of one host. A host with cameras waits for the fusing host, which also
/// gives the time at which the run began. Returns `None` on a stop request.
///
/// * `chosen`: the host that the user named, and true for a check that starts nothing.
pub(crate) fn resolve(
    deployment: &Deployment,
    (named, is_dry): (Option<&str>, bool),
    stop: &Stop,
) -> Result<Option<(Resolved, Option<u64>)>, Failure> {
    let Some(host) = hosts::choose(deployment, named, &machine())? else {
        let resolved = plan::resolve(deployment)?;
        return Ok(Some((resolved, None)));
    };
    if !is_dry {
        in_one_thread()?;
    }
    let session = if host.fuses || is_dry {
        None
    } else {
        let address = hosts::address(deployment, host)?;
        let fingerprint = hosts::fingerprint(deployment)?;
        let mut say = |text: &str| output::message(text);
        let joined = bridge::join(&address, &fingerprint, stop, &mut say);
        match joined.or_fail(ExitKind::Config)? {
            Some(session) => Some(session),
            None => return Ok(None),
        }
    };
    let resolved = plan::resolve_on(&hosts::part(deployment, host), Some(host))?;
    Ok(Some((resolved, session)))
}

/// Restarts this program in the same process, with the environment variable that makes its link run in one thread
/// ([`bridge::ONE_THREAD`]). Child processes inherit the variable.
fn in_one_thread() -> Result<(), Failure> {
    if bridge::has_one_thread() {
        return Ok(());
    }
    let (name, value) = bridge::ONE_THREAD;
    let program = std::env::current_exe().or_fail(ExitKind::Run)?;
    let arguments = std::env::args_os().skip(1);
    // `exec` returns only if it fails.
    let error = Program::new(program).args(arguments).env(name, value).exec();
    Err(Failure::new(
        ExitKind::Run,
        format!("this program cannot restart itself: {error}"),
    ))
}

/// Returns the name of this machine.
fn machine() -> String {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname");
    name.unwrap_or_default().trim().to_owned()
}

fn status(arguments: &StatusArguments) -> Result<ExitCode, Failure> {
    let loaded = load::read(&arguments.config, &[])?;
    let deployment = &loaded.deployment;
    let named = arguments.host.as_deref();
    let host = hosts::choose(deployment, named, &machine())?;
    let host = host.ok_or("the deployment has no [[host]]").or_fail(ExitKind::Usage)?;
    in_one_thread()?;
    let mut address = hosts::address(deployment, host)?;
    // On the fusing host, the bridge already listens on the address, so this command connects to the bridge.
    address.listens = false;
    let text = bridge::status(&address, PATIENCE).or_fail(ExitKind::Run)?;
    let Some(text) = text else {
        let message = format!(
            "{} does not answer: is the deployment running there?",
            address.address
        );
        return Err(Failure::new(ExitKind::Input, message));
    };
    let state: Value = serde_json::from_str(&text).or_fail(ExitKind::Run)?;
    let none = Vec::new();
    let all = state["hosts"].as_array().unwrap_or(&none);
    if arguments.json {
        output::json(&state)?;
    } else {
        for it in all {
            output::line(line(it, deployment).trim_end())?;
        }
    }
    let is_whole = all.iter().all(|value| value["there"] == true);
    let status = if is_whole {
        0
    } else {
        ExitKind::Degraded.status()
    };
    Ok(ExitCode::from(status))
}

/// Describes a host, with a line for every view.
fn line(host: &Value, deployment: &Deployment) -> String {
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let name = host["name"].as_str().unwrap_or_default();
    let there = if host["there"] == true {
        "answers"
    } else if host["refused"].is_null() {
        "does not answer"
    } else {
        "is not accepted: its files differ"
    };
    let clock = &host["clock"];
    let clock = if clock.is_null() {
        "clock unknown".to_owned()
    } else {
        format!(
            "clock known to within {:.3} ms, drift {:.1} ppm, round trip {:.3} ms",
            number(&clock["bound_ms"]),
            number(&clock["drift_ppm"]),
            number(&clock["trip_ms"])
        )
    };
    let mut text = format!("{name}: {there}; {clock}\n");
    for view in host["views"].as_array().into_iter().flatten() {
        let index = view["view"].as_u64().unwrap_or(0) as usize;
        let camera = deployment.cameras.get(index).map_or("?", |camera| camera.name.as_str());
        // Writing to a string cannot fail.
        let _infallible = writeln!(
            text,
            "    {camera}: {} used, {} late, {} lost, {} left out; transfer {:.1} ms (99 of 100 within {:.1} ms)",
            view["used"],
            view["late"],
            view["gone"],
            view["left_out"],
            number(&view["all"]["p50_ms"]),
            number(&view["all"]["p99_ms"])
        );
    }
    text
}

fn keys(arguments: &KeysArguments) -> Result<ExitCode, Failure> {
    let loaded = load::read(&arguments.config, &[])?;
    let deployment = &loaded.deployment;
    let folder = deployment
        .link
        .keys
        .as_deref()
        .ok_or("the deployment has no `link.keys`")
        .or_fail(ExitKind::Config)?;
    let names = deployment.hosts.iter().map(|host| {
        let address = host.address.iter();
        let name = address.filter_map(|address| address.rsplit_once(':')).map(|parts| {
            let name = parts.0.trim_start_matches('[').trim_end_matches(']');
            name.to_owned()
        });
        (host.name.clone(), name.collect())
    });
    let names: Vec<(String, Vec<String>)> = names.collect();
    let made = bridge::make_keys(folder, &names).or_fail(ExitKind::Input)?;
    for file in made {
        output::line(file.display())?;
    }
    output::message(
        "copy ca.pem and the host's own two files to every host; keep ca.key elsewhere",
    );
    Ok(ExitCode::SUCCESS)
}
