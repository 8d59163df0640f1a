//! `parallax record`: runs a deployment, and records every message in one file.

mod disk_space;

use std::fs::TryLockError;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};
use deployment::RecordingPlan;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use launch::{Planned, Resolved, load, recorded};
use terminal::{Globals, output};

use super::hosts;
use disk_space::{Forecast, Growth, PerFrame};

/// Number of epochs (restarts) of the recording process for which files of an earlier recording are looked up.
const MAX_EPOCHS: u32 = 64;

/// Options of `parallax record`.
#[derive(Debug, Args)]
#[command(after_help = "\
The file is MCAP: chunked, indexed and not compressed. Messages are CDR with ROS 2 schemas. The metadata contains \
the settings of the run, and fingerprints of the files that it read. The run also writes its results, like `run`.

With lossless delivery (capture.mode = \"lossless\"), a slow disk slows down the run. With realtime delivery it does \
not: messages that do not fit into the queue are left out. They are counted by topic in the file, and reported at the end. \
A file whose end is missing, because of a full disk or a crash, is valid up to that point. A restarted recording \
process continues in FILE.1.mcap. If anything was lost, the exit code is 7.

For live cameras, the file also contains the original pictures at the full rate of the camera: JPEG files, raw pixels, \
or the packets of a stream. `parallax replay FILE --from capture`, or `source = \"FILE#NAME\"` in a deployment, searches \
these pictures later. No camera waits for the disk. Results go to the deployment's `output`; `--set output=DIR` sets another folder.

Foxglove opens the file directly, and shows skeletons with their uncertainty, cameras and pictures. Besides Parallax's topics, the file \
contains `foxglove.SceneUpdate`, `foxglove.FrameTransforms`, `foxglove.CameraCalibration` and `foxglove.CompressedImage`.

With several hosts (`[[host]]`), the fusing host records all messages that arrive. Frames that other hosts do not send are missing. A \
host with cameras records the output of its own cameras and processes. A deployment can use such a file as `source = \"FILE#NAME\"`.

Before the run, the command prints the maximum size of one frame and of one second, and the free space. It does not start \
without space for ten frames, or for all frames if there are fewer.

Examples:
    parallax record my.toml --out run.mcap
    parallax record my.toml --out run.mcap --without pixels --without evidence   a small file: only poses, results,
                                                                                 and pictures of live cameras")]
pub(crate) struct Arguments {
    /// The deployment file.
    config: PathBuf,
    /// The file to record to.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace FILE if it exists, and also the results of an earlier run.
    #[arg(long)]
    force: bool,
    /// Leave out a kind of large messages. May be given several times.
    #[arg(long, value_name = "WHAT")]
    without: Vec<Bulk>,
    /// Memory for messages that wait to be written, in megabytes.
    #[arg(long, value_name = "MB", default_value_t = 256, value_parser = clap::value_parser!(u64).range(1..=65_536))]
    queue_mb: u64,
    /// Folder for the results, in place of `output` in the deployment file.
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
    /// Replace a value, for example `--set capture.scale=0.5`. May be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Name of this machine in a deployment with several `[[host]]`. If not given, the host name of this machine.
    #[arg(long, value_name = "NAME")]
    host: Option<String>,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

/// The kinds of large messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Bulk {
    /// The pixels of frames. Without them, a replay from pose is impossible.
    Pixels,
    /// The response maps. Without them, a replay from fuse is impossible.
    Evidence,
    /// The original pictures of live cameras. Without them, a replay from capture is impossible.
    Camera,
    /// The topics for Foxglove: skeletons, cameras, and their pictures as JPEG.
    Foxglove,
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
        pictures: Vec::new(),
        without_foxglove: arguments.without.contains(&Bulk::Foxglove),
    };
    launch::check_name(&loaded.deployment)?;
    launch::make_way(&loaded.deployment.output, arguments.force)?;
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let chosen = (arguments.host.as_deref(), false);
    let Some((resolved, session)) = hosts::resolve(&loaded.deployment, chosen, &stop)? else {
        return Ok(ExitCode::from(ExitKind::Interrupted.status()));
    };
    let pictures = if arguments.without.contains(&Bulk::Camera) {
        Vec::new()
    } else {
        resolved.live_views()
    };
    let resolved = Resolved {
        recording: Some(RecordingPlan { pictures, ..plan }),
        ..resolved
    };
    let planned = Planned::begun(resolved, globals.level(), session)?;
    let forecast = forecast(&planned, &file, arguments)?;
    forecast.check(&file)?;
    remove_existing(&file, arguments.force)?;
    if !globals.quiet {
        if let Some(size) = &planned.resolved().search_size {
            output::message(size.text());
        }
        output::message(forecast.text(&file));
    }
    let mut growth = Growth::new(&file, &forecast);
    let report = planned.run(globals.quiet, &stop, &mut |_| growth.message())?;
    let recording = recorded::open(&file)?;
    let later = (1..MAX_EPOCHS).map(|i| record::file_of_life(&file, i));
    let later: Vec<PathBuf> = later.take_while(|file| file.exists()).collect();
    if arguments.json {
        let mut value = report.json();
        value["recording"] = recorded::json(&file, &recording);
        value["recording"]["goes_on_in"] =
            later.iter().map(|later| later.display().to_string()).collect();
        output::json(&value)?;
    } else if !globals.quiet {
        output::line(report.text())?;
        output::line(recorded::text(&file, &recording))?;
        for file in &later {
            output::line(format_args!("  continues in {}", file.display()))?;
        }
    }
    let is_flawed = !recorded::is_whole(&recording) || !later.is_empty();
    let kind = report.kind().or(is_flawed.then_some(ExitKind::Degraded));
    Ok(ExitCode::from(kind.map_or(0, ExitKind::status)))
}

/// Estimates the disk space of the recording.
fn forecast(planned: &Planned, file: &Path, arguments: &Arguments) -> Result<Forecast, Failure> {
    let resolved = planned.resolved();
    let replaced = if arguments.force {
        std::fs::metadata(file).map_or(0, |metadata| metadata.len())
    } else {
        0
    };
    Ok(Forecast {
        per_frame: PerFrame::new(
            &planned.plan().topics,
            !arguments.without.contains(&Bulk::Foxglove),
        ),
        without: [Bulk::Pixels, Bulk::Evidence].map(|bulk| arguments.without.contains(&bulk)),
        n_frames: (!resolved.is_endless()).then(|| resolved.n_frames()),
        rate_hz: resolved.footage.iter().find_map(|footage| footage.frame_rate_hz),
        free_bytes: disk_space::free_beside(file)? + replaced,
    })
}

/// Removes the files of an earlier recording.
///
/// # Errors
///
/// Fails if a file exists and `force` is not set, if it is a folder, or if another run is recording to it.
fn remove_existing(file: &Path, force: bool) -> Result<(), Failure> {
    let files = (0..MAX_EPOCHS).map(|i| record::file_of_life(file, i));
    for file in files.filter(|file| file.exists()) {
        if file.is_dir() {
            let message = format!("{} is a folder", file.display());
            let failure = Failure::new(ExitKind::Usage, message);
            return Err(failure.with_hint("give the name of the recording file, such as run.mcap"));
        }
        if !force {
            let message = format!("{} already exists", file.display());
            let failure = Failure::new(ExitKind::Usage, message);
            return Err(
                failure.with_hint("choose another name, or pass --force to replace the file")
            );
        }
        let is_busy = files::open(&file)
            .is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)));
        if is_busy {
            let message = format!("another run is recording to {}", file.display());
            let failure = Failure::new(ExitKind::Config, message);
            return Err(failure.with_hint("wait until that run ends, or choose another name"));
        }
        std::fs::remove_file(&file).map_err(|error| failure::in_file(&file, &error))?;
    }
    Ok(())
}
