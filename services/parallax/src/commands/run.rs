//! `parallax run`: a whole deployment, from footage to the summary.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use runtime::{ExitKind, Failure, OrFail as _, Stop, free_shared_memory};
use supervise::Plan;

use crate::cli::Globals;
use crate::deployment::Loaded;
use crate::plan::{self, Resolved};
use crate::prepare::Prepared;
use crate::summary::{Report, Watcher};
use crate::{inputs, output};

/// What to run.
#[derive(Debug, Args)]
#[command(after_help = "\
A second Ctrl-C ends the run at once. The output folder holds pose3d.jsonl, pose3d.csv, pose3d.trc,
pose2d.jsonl, latency.json, summary.json, deployment.json and overlays/; files of an earlier run are
replaced when the new ones are whole, until then they are called *.part.

Examples:
    parallax run configs/pose2sim-balancing.toml
    parallax run my.toml --out /tmp/try --set capture.n_frames=20 --set fuse.workers=2
    parallax run my.toml --dry-run")]
pub(crate) struct Arguments {
    /// The deployment file.
    config: PathBuf,
    /// Folder for the results, instead of the file's `output`.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace a value, for example `--set fuse.workers=2`; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Show what would be started and how much shared memory it needs, and start nothing.
    #[arg(long)]
    dry_run: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the deployment until its footage ends, or it is told to stop.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let mut loaded = Loaded::read(&arguments.config, &arguments.set)?;
    if let Some(out) = &arguments.out {
        loaded.deployment.output = std::path::absolute(out).or_fail(ExitKind::Usage)?;
    }
    let resolved = Resolved::new(&loaded.deployment)?;
    let prepared = Prepared::new(&resolved)?;
    prepared.check_predictions(&resolved)?;
    let folder = &resolved.deployment.output;
    let file = folder.join("deployment.json");
    let plan = plan::plan(&resolved, &prepared, &file, globals.level())?;
    if arguments.dry_run {
        return show(&plan);
    }
    std::fs::create_dir_all(folder).map_err(|error| inputs::in_file(folder, &error))?;
    resolved.write(&file)?;
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let begin = Instant::now();
    let mut watcher = Watcher::new(&resolved, globals.quiet);
    let outcome = supervise::run(&plan, &stop, &mut |event| watcher.note(&event));
    watcher.finish();
    let report = Report::new(&resolved, plan.session, &outcome?, begin.elapsed());
    if arguments.json {
        output::json(&report.json())?;
    } else if !globals.quiet {
        output::line(report.text())?;
    }
    Ok(ExitCode::from(report.kind().map_or(0, ExitKind::status)))
}

/// Processes, topics and memory.
fn show(plan: &Plan) -> Result<ExitCode, Failure> {
    output::line(format_args!("{} processes:", plan.processes.len()))?;
    for process in &plan.processes {
        output::line(format_args!("  {}", process.name))?;
    }
    let total: u64 = plan.topics.iter().map(runtime::TopicPlan::pool_bytes).sum();
    let free = free_shared_memory().or_fail(ExitKind::Run)?;
    let mb = |bytes: u64| bytes as f64 / 1e6;
    output::line(format_args!(
        "shared memory: {:.0} MB of {:.0} MB free in /dev/shm; the largest topics:",
        mb(total),
        mb(free)
    ))?;
    let mut topics: Vec<_> = plan.topics.iter().collect();
    topics.sort_by_key(|it| core::cmp::Reverse(it.pool_bytes()));
    for topic in topics.iter().take(8) {
        output::line(format_args!(
            "  {:<20} {:>8.1} MB",
            topic.topic(),
            mb(topic.pool_bytes())
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
