//! `parallax status` and `parallax clean`: list running deployments, and the shared memory that dead deployments left behind.

use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure};
use launch::live::{self, Live};
use runtime::{Namespace, Remains, deployments};
use serde_json::{Value, json};
use terminal::output;

/// Text for a directory that does not belong to a deployment.
const UNMARKED: &str = "not a deployment: ignored";

/// Options of `parallax status`.
#[derive(Debug, Args)]
#[command(after_help = "\
With a DEPLOYMENT, prints the table of `parallax top --once`: every process, its state, and the percentiles of its stages. \
`parallax top --help` explains the table. With --json, times are in milliseconds, and memory is in bytes.")]
pub(crate) struct StatusArguments {
    /// Name or file of a running deployment. If given, its processes and times are shown.
    deployment: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Options of `parallax clean`.
#[derive(Debug, Args)]
pub(crate) struct CleanArguments {
    /// Names of dead deployments. If not given, all dead deployments.
    names: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Lists the deployments of this user, or shows the processes of one deployment.
pub(crate) fn status(arguments: &StatusArguments) -> Result<ExitCode, Failure> {
    if let Some(named) = &arguments.deployment {
        return status_of(named, arguments.json);
    }
    let found = deployments(&Namespace::usual_base())?;
    if arguments.json {
        let all: Vec<Value> = found.iter().map(describe).collect();
        output::json(&json!({ "schema_version": 1, "deployments": all }))?;
        return Ok(ExitCode::SUCCESS);
    }
    if found.is_empty() {
        output::message(
            "no deployment is running, and no dead deployment has left shared memory behind",
        );
    }
    for deployment in &found {
        let name = deployment.namespace.name();
        let how = match deployment.supervisor {
            _ if !deployment.is_marked => UNMARKED.to_owned(),
            Some(pid) => format!(
                "running (process {pid}), {} processes",
                deployment.processes.len()
            ),
            None if deployment.processes.is_empty() => {
                "dead: `parallax clean` removes the leftovers".to_owned()
            }
            None => format!(
                "dead, but these processes are still running: {}",
                deployment.processes.join(", ")
            ),
        };
        output::line(format_args!("{name:<32} {:>10}  {how}", size(deployment)))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Shows the processes of a running deployment.
fn status_of(named: &str, json: bool) -> Result<ExitCode, Failure> {
    let namespace = live::namespace(Some(named))?;
    let snapshot = Live::open(&namespace)?.first_snapshot()?;
    if json {
        output::json(&json!({ "schema_version": 1, "deployment": live::describe(&snapshot) }))?;
    } else {
        output::line(live::table(&snapshot).trim_end())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Removes the shared memory of this user's dead deployments. Running deployments are not touched.
pub(crate) fn clean(arguments: &CleanArguments) -> Result<ExitCode, Failure> {
    let found = deployments(&Namespace::usual_base())?;
    for name in &arguments.names {
        if !found.iter().any(|remains| remains.namespace.name() == name) {
            let message = format!("there is no shared memory of a deployment {name:?}");
            return Err(Failure::new(ExitKind::Usage, message));
        }
    }
    let is_selected = |remains: &&Remains| match &arguments.names[..] {
        [] => remains.supervisor.is_none() && remains.is_marked,
        names => names.iter().any(|name| name == remains.namespace.name()),
    };
    for it in found.iter().filter(|remains| !remains.is_marked) {
        let path = it.namespace.root().display();
        output::message(format_args!("{path}: {UNMARKED}"));
    }
    let (mut removed, mut failed) = (Vec::new(), Vec::new());
    for it in found.iter().filter(is_selected) {
        match it.remove() {
            Ok(()) => removed.push(it),
            Err(error) => failed.push((it.namespace.name(), error.to_string())),
        }
    }
    for (_, why) in &failed {
        output::message(format_args!("error: {why}"));
    }
    if arguments.json {
        let removed: Vec<Value> = removed.into_iter().map(describe).collect();
        let failed = failed.iter().map(|(name, why)| json!({ "name": name, "why": why }));
        let failed: Vec<Value> = failed.collect();
        output::json(&json!({ "schema_version": 1, "removed": removed, "failed": failed }))?;
    } else {
        for it in removed {
            output::line(format_args!(
                "removed {}, {}",
                it.namespace.name(),
                size(it)
            ))?;
        }
    }
    Ok(if failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(ExitKind::Run.status())
    })
}

fn describe(remains: &Remains) -> Value {
    json!({
        "name": remains.namespace.name(),
        "is_deployment": remains.is_marked,
        "supervisor": remains.supervisor,
        "processes": remains.processes,
        "files": remains.n_files,
        "bytes": remains.bytes,
    })
}

fn size(remains: &Remains) -> String {
    format!("{:.1} MB", remains.bytes as f64 / 1e6)
}
