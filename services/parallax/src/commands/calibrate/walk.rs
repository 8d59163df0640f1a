//! Common part of `calibrate people` and `calibrate refine`: reads the people seen by all cameras, and writes a rig file.

use std::path::{Path, PathBuf};

use calibration::people::Doubt;
use clap::Args;
use deployment::Deployment;
use failure::{Console as _, ExitKind, Failure, OrFail as _, Stop};
use geometry::files::Format;
use geometry::{Camera, Rig};
use launch::films::{Films, Part, Poses, films};
use launch::load;
use nalgebra::UnitVector3;

use terminal::{Globals, Terminal};

/// The progress bar.
const BAR: &str = "{elapsed_precise} {bar:20} {pos}/{len} pictures, {per_sec}{left} {prefix} {msg}";

/// Options of both commands.
#[derive(Debug, Args)]
pub(super) struct WalkArguments {
    /// The deployment file. Its rig must have the intrinsics.
    pub(super) config: PathBuf,
    /// Rig file to write. The file is not written if the result is rejected.
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    /// Write a page with residuals, positions of people in the pictures, uncertainties, the rig in space, and the worst pictures.
    #[arg(long, value_name = "FILE")]
    pub(super) report: Option<PathBuf>,
    /// Use every n-th picture.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub(super) every: u64,
    /// Start at this time in the footage of each camera, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = seconds)]
    pub(super) from: f64,
    /// Length of the footage to use, in seconds. If not given, all footage.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub(super) seconds: Option<f64>,
    /// Maximum number of instants to use, spread evenly over the footage.
    #[arg(long, value_name = "N", default_value_t = 300, value_parser = clap::value_parser!(u64).range(12..=5000))]
    pub(super) instants: u64,
    /// Replace a value of the deployment, for example `--set rig=lab.toml`. May be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    pub(super) json: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value| (0.0..=1e6).contains(value));
    number.ok_or_else(|| format!("expected 0 to 1000000 seconds, got {text:?}"))
}

/// People in the footage of all cameras.
pub(super) struct Walk {
    pub(super) deployment: Deployment,
    pub(super) found: Films,
    /// Clock offsets from the deployment, in seconds, which are added to the times of each camera.
    pub(super) offsets_s: Vec<f64>,
}

impl Walk {
    /// Returns the names of the cameras.
    pub(super) fn names(&self) -> Vec<&str> {
        self.found.cameras.iter().map(|camera| camera.name.as_str()).collect()
    }
}

/// Reads the people from keypoint files, or finds them in the pictures.
pub(super) fn walk(
    arguments: &WalkArguments,
    poses: Poses,
    globals: Globals,
    stop: &Stop,
) -> Result<Walk, Failure> {
    let deployment = load::read(&arguments.config, &arguments.set)?.deployment;
    let deployment = launch::cameras::settled(&deployment)?;
    if deployment.cameras.len() < 2 {
        let message = "the deployment has only one camera, but at least two are needed to find the pose of a camera";
        return Err(Failure::new(ExitKind::Config, message));
    }
    let terminal = Terminal::with_bar(globals.quiet, false, BAR)
        .ticking()
        .in_lines_off_terminals("pictures");
    let part = Part {
        every: arguments.every,
        from_s: arguments.from,
        seconds: arguments.seconds,
    };
    let mut found = films(&deployment, part, poses, (stop, &terminal))?;
    terminal.finish();
    terminal.message("adjusting");
    for (camera, film) in deployment.cameras.iter().zip(&mut found.films) {
        let pace = 1.0 + 1e-6 * camera.drift_ppm.unwrap_or(0.0);
        for shot in &mut film.shots {
            shot.time_s *= pace;
        }
    }
    let offsets = deployment.cameras.iter();
    let offsets_s = offsets.map(|offset| 1e-3 * offset.offset_ms.unwrap_or(0.0)).collect();
    Ok(Walk {
        deployment,
        found,
        offsets_s,
    })
}

/// Writes the rig file.
pub(super) fn write_rig(
    file: &Path,
    cameras: Vec<Camera>,
    up: Option<UnitVector3<f64>>,
    source: &str,
) -> Result<(), Failure> {
    let rig = Rig::new(cameras, up, source).or_fail(ExitKind::Calibration)?;
    geometry::files::write(file, Format::Own, &rig).or_fail(ExitKind::Input)
}

/// Fails if the result is refused.
pub(super) fn refuse(doubts: &[Doubt], names: &[&str], hint: &str) -> Result<(), Failure> {
    if doubts.is_empty() {
        return Ok(());
    }
    let texts: Vec<String> = doubts.iter().map(|doubt| doubt.text(names)).collect();
    let message = format!("the rig is not determined:\n  {}", texts.join("\n  "));
    Err(Failure::new(ExitKind::Degraded, message).with_hint(hint))
}
