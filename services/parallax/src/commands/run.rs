//! `parallax run`: runs a whole deployment.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::{Planned, load};
use runtime::{free_shared_memory, needed_bytes, preflight};
use supervise::Plan;
use terminal::{Globals, output};

use super::{hosts, publish, view};

/// Options of `parallax run`.
#[derive(Debug, Args)]
#[command(after_help = "\
Ctrl-C stops the run. A second Ctrl-C, at least half a second after the first, ends it at once.

The output folder contains pose3d.jsonl, pose3d.csv, pose3d.trc, pose2d.jsonl, times.jsonl, latency.json, summary.json, \
deployment.json and overlays/. Only the user who started the run can read these files. They are called *.part until they are \
complete. With --force, the results of an earlier run are replaced when the new ones are complete. A file that no run has \
written is never replaced. Only one run at a time can use the folder.

pose3d.jsonl has one line per frame, in order: the result, or the status \"no result\" with the reason. pose3d.trc has a row of NaN \
for a frame without a result. It is written only if the frame rate is known. A run without any result is degraded, and the \
summary says why.

Examples:
    parallax run my.toml
    parallax run my.toml --out /tmp/try --set capture.n_frames=20 --set capture.scale=0.5
    parallax run my.toml --latency-budget-ms 150
    parallax run my.toml --publish udp://127.0.0.1:9000
    parallax run my.toml --dry-run
    parallax run my.toml --host left        run the part of one of several machines

During the run, `parallax top` and `parallax status NAME --json` show every process and its times. With a \
latency budget, the run ends with exit code 6 if the 99th percentile from capture to result exceeds the budget. It also does so \
if no frame was measured, unless Ctrl-C stopped the run before the first measurement.")]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a flag of the command line"
)]
pub(crate) struct Arguments {
    /// The deployment file.
    config: PathBuf,
    /// Folder for the results, in place of `output` in the deployment file.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the results of an earlier run in the output folder.
    #[arg(long, conflicts_with = "dry_run")]
    force: bool,
    /// Replace a value, for example `--set capture.scale=0.5`. May be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Name of this machine in a deployment with several `[[host]]`. If not given, the host name of this machine.
    #[arg(long, value_name = "NAME")]
    host: Option<String>,
    /// Fail with exit code 6 if more than 1 frame in 100 takes longer than this from capture to result, in milliseconds. The same
    /// as `--set supervise.latency_budget_ms=N`.
    #[arg(long, value_name = "N", value_parser = above_zero, allow_negative_numbers = true)]
    latency_budget_ms: Option<f64>,
    /// Serve a page about the run while it runs, on this machine only. `parallax view --help` describes the page.
    #[arg(long, conflicts_with = "dry_run")]
    view: bool,
    /// Send the skeletons as datagrams during the run, to udp://HOST:PORT (JSON lines) or osc://HOST:PORT. May be given several
    /// times. `parallax publish --help` describes the datagrams.
    #[arg(long, value_name = "TARGET", conflicts_with = "dry_run")]
    publish: Vec<String>,
    /// Allow --publish to send to other machines. Skeletons are sent unencrypted.
    #[arg(long, requires = "publish")]
    beyond_this_machine: bool,
    /// Show the processes and the shared memory that they need, but start nothing. Fails if the run could not start.
    #[arg(long)]
    dry_run: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the deployment until its footage ends or a stop is requested.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let budget = arguments.latency_budget_ms;
    let budget = budget.map(|budget| format!("supervise.latency_budget_ms={budget:?}"));
    let set: Vec<String> = arguments.set.iter().cloned().chain(budget).collect();
    let mut loaded = load::read(&arguments.config, &set)?;
    if let Some(out) = &arguments.out {
        loaded.deployment.output = std::path::absolute(out).or_fail(ExitKind::Usage)?;
    }
    if !arguments.dry_run {
        launch::check_name(&loaded.deployment)?;
        launch::make_way(&loaded.deployment.output, arguments.force)?;
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let chosen = (arguments.host.as_deref(), arguments.dry_run);
    let Some((resolved, session)) = hosts::resolve(&loaded.deployment, chosen, &stop)? else {
        return Ok(ExitCode::from(ExitKind::Interrupted.status()));
    };
    if resolved.is_far() && (arguments.view || !arguments.publish.is_empty()) {
        let message =
            "--view and --publish work only on the fusing host: this host has no skeletons";
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let device = launch::device(&loaded.deployment)?;
    if let Some(device) = device.filter(|_| !globals.quiet) {
        output::message(device);
    }
    let planned = Planned::begun(resolved, globals.level(), session)?;
    if arguments.dry_run {
        if let Some(size) = &planned.resolved().search_size {
            output::line(size.text())?;
        }
        return show(planned.plan());
    }
    if let Some(size) = planned.resolved().search_size.as_ref().filter(|_| !globals.quiet) {
        output::message(size.text());
    }
    let name = &loaded.deployment.name;
    let page = arguments.view.then(|| view::beside(name)).transpose()?;
    let companion = publish::beside(name, &arguments.publish, arguments.beyond_this_machine)?;
    let report = planned.run(globals.quiet, &stop, &mut |_| None)?;
    drop(page);
    publish::finish(companion, globals.quiet);
    if arguments.json {
        output::json(&report.json())?;
    } else if !globals.quiet {
        output::line(report.text())?;
    }
    match (report.kind(), report.budget()) {
        (Some(ExitKind::Limit), Some(budget)) => {
            Err(Failure::new(ExitKind::Limit, budget.error_text()))
        }
        (kind, _) => Ok(ExitCode::from(kind.map_or(0, ExitKind::status))),
    }
}

fn above_zero(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().ok().ok_or("not a number")?;
    let fits = number.is_finite() && number > 0.0;
    fits.then_some(number).ok_or_else(|| "the number is not above 0".to_owned())
}

/// Prints processes, shared memory and the largest topics.
fn show(plan: &Plan) -> Result<ExitCode, Failure> {
    output::line(format_args!("{} processes:", plan.processes.len()))?;
    for process in &plan.processes {
        let line = format!("  {:<12} {}", process.name, process.scheduling);
        output::line(line.trim_end())?;
    }
    let total = needed_bytes(&plan.topics);
    let free = free_shared_memory().or_fail(ExitKind::Run)?;
    let mb = |bytes: u64| bytes as f64 / 1e6;
    output::line(format_args!(
        "shared memory: {:.0} MB are needed, and {:.0} MB are free in /dev/shm; the largest topics:",
        mb(total),
        mb(free)
    ))?;
    let mut topics: Vec<_> = plan.topics.iter().collect();
    topics.sort_by_key(|topic| core::cmp::Reverse(topic.pool_bytes()));
    for topic in topics.iter().take(8) {
        output::line(format_args!(
            "  {:<20} {:>8.1} MB",
            topic.topic(),
            mb(topic.pool_bytes())
        ))?;
    }
    // A run begins with the same check.
    preflight(&plan.topics)?;
    Ok(ExitCode::SUCCESS)
}
