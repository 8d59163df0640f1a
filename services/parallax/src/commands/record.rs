//! `parallax record`: a run, and every message of it in one file.

mod room;

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use deployment::RecordingPlan;
use launch::{Planned, Resolved, load, output, plan, recorded};
use runtime::{ExitKind, Failure, OrFail as _, Stop};

use crate::globals::Globals;
use room::{Forecast, Growth, PerFrame};

/// Lives of the recording process that are looked for.
const MOST_LIVES: u32 = 64;

/// What to record.
#[derive(Debug, Args)]
#[command(after_help = "\
The file is MCAP: chunked, indexed, not compressed, its messages CDR with ROS 2 schemas; its metadata holds
the settings of the run and fingerprints of the files that it read. The run leaves its results as `run` does.

Where nothing may be lost (capture.mode = \"lossless\") a slow disk makes the run slower. Where the latest wins
it never does: what does not fit into the queue is left out, counted by topic in the file, and told at the end.
A file whose end was never written, because of a full disk or a crash, holds all up to there; a recording
process that had to be restarted goes on in FILE.1.mcap. With anything lost the exit code is 7.

Before it begins it says how much a frame and a second will take at most, and how much is free; it does not begin
where there is no room for ten frames (or for all, if they are fewer).

Examples:
    parallax record my.toml --out run.mcap
    parallax record my.toml --out run.mcap --without pixels --without evidence   small: poses and results")]
pub(crate) struct Arguments {
    /// The deployment file.
    config: PathBuf,
    /// The recording.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace FILE if it is there.
    #[arg(long)]
    force: bool,
    /// Leave out what takes most room; may be given twice.
    #[arg(long, value_name = "WHAT")]
    without: Vec<Bulk>,
    /// Memory for what waits to be written, millions of bytes.
    #[arg(long, value_name = "MB", default_value_t = 256, value_parser = clap::value_parser!(u64).range(1..=65_536))]
    queue_mb: u64,
    /// Folder for the results, instead of the file's `output`.
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Replace a value, for example `--set fuse.workers=2`; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// What takes most room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Bulk {
    /// The pixels of frames; without them nothing can be replayed from pose on.
    Pixels,
    /// Response maps; without them nothing can be replayed from fuse on.
    Evidence,
}

/// Runs the deployment and records it.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let mut loaded = load::read(&arguments.config, &arguments.set)?;
    if let Some(results) = &arguments.results {
        loaded.deployment.output = std::path::absolute(results).or_fail(ExitKind::Usage)?;
    }
    let file = std::path::absolute(&arguments.out).or_fail(ExitKind::Usage)?;
    let plan = RecordingPlan {
        file: file.clone(),
        without_pixels: arguments.without.contains(&Bulk::Pixels),
        without_evidence: arguments.without.contains(&Bulk::Evidence),
        queue_mb: arguments.queue_mb,
    };
    let resolved = Resolved {
        recording: Some(plan),
        ..plan::resolve(&loaded.deployment)?
    };
    let planned = Planned::of(resolved, globals.level())?;
    let forecast = forecast(&planned, &file, arguments)?;
    forecast.check(&file)?;
    make_way(&file, arguments.force)?;
    if !globals.quiet {
        output::message(forecast.text(&file));
    }
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let mut growth = Growth::new(&file, &forecast);
    let report = planned.run(globals.quiet, &stop, &mut |_| growth.note())?;
    let recording = recorded::open(&file)?;
    let later = (1..MOST_LIVES).map(|it| record::file_of_life(&file, it));
    let later: Vec<PathBuf> = later.take_while(|it| it.exists()).collect();
    if arguments.json {
        let mut value = report.json();
        value["recording"] = recorded::json(&file, &recording);
        value["recording"]["goes_on_in"] =
            later.iter().map(|it| it.display().to_string()).collect();
        output::json(&value)?;
    } else if !globals.quiet {
        output::line(report.text())?;
        output::line(recorded::text(&file, &recording))?;
        for file in &later {
            output::line(format_args!("  goes on in {}", file.display()))?;
        }
    }
    let flawed = !recorded::is_whole(&recording) || !later.is_empty();
    let kind = report.kind().or(flawed.then_some(ExitKind::Degraded));
    Ok(ExitCode::from(kind.map_or(0, ExitKind::status)))
}

/// How much room the recording will take.
fn forecast(planned: &Planned, file: &Path, arguments: &Arguments) -> Result<Forecast, Failure> {
    let resolved = planned.resolved();
    let replaced = if arguments.force {
        std::fs::metadata(file).map_or(0, |it| it.len())
    } else {
        0
    };
    Ok(Forecast {
        per_frame: PerFrame::new(&planned.plan().topics),
        without: [Bulk::Pixels, Bulk::Evidence].map(|it| arguments.without.contains(&it)),
        n_frames: resolved.n_frames(),
        rate_hz: resolved.footage.iter().find_map(|it| it.frame_rate_hz),
        free_bytes: room::free_beside(file)? + replaced,
    })
}

/// Sees that no file is in the way.
fn make_way(file: &Path, force: bool) -> Result<(), Failure> {
    let lives = (0..MOST_LIVES).map(|it| record::file_of_life(file, it));
    for file in lives.filter(|it| it.exists()) {
        if file.is_dir() {
            let message = format!("{} is a folder", file.display());
            let failure = Failure::new(ExitKind::Usage, message);
            return Err(
                failure.with_hint("name the file that the recording goes to, such as run.mcap")
            );
        }
        if !force {
            let message = format!("{} is there already", file.display());
            let failure = Failure::new(ExitKind::Usage, message);
            return Err(failure.with_hint("take another name, or --force to replace it"));
        }
        let busy = File::open(&file)
            .is_ok_and(|it| matches!(it.try_lock_shared(), Err(TryLockError::WouldBlock)));
        if busy {
            let message = format!("{} is being recorded to by another run", file.display());
            let failure = Failure::new(ExitKind::Config, message);
            return Err(failure.with_hint("wait until it ends, or take another name"));
        }
        std::fs::remove_file(&file).map_err(|error| runtime::in_file(&file, &error))?;
    }
    Ok(())
}
