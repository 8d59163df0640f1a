//! `parallax smooth`: smooths the trajectories of a finished run.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure};
use motion::finished::{self, Method, Outcome, Request, Settings};
use nalgebra::UnitVector3;
use serde_json::{Value, json};
use terminal::{Globals, Terminal, output};

/// The progress bar.
const BAR: &str = "{elapsed_precise} {bar:20} {pos}/{len} motions{left} {prefix} {msg}";

/// Options of `parallax smooth`.
#[derive(Debug, Args)]
#[command(after_help = "\
FOLDER contains the results of a run. They are not changed. The command adds the files
    pose3d-smooth.jsonl   like pose3d.jsonl, with the state of each joint in `states`
    angles.csv            angles of hips, knees, ankles, shoulders, elbows and trunk, in degrees
    smooth.json           the method, its parameters, and the number of measurements by state

A joint is measured, exchanged, filled or rejected. Angles have standard deviations. \
No options are needed: the process noise and the scale of the covariances of each joint are estimated from the measurements. \
See docs/guide/smooth.md.

If you have ground truth, `parallax-lab smooth` compares the result with it.

Exit codes: 0 done; 7 done, but with doubts (`doubts`: the file is truncated, nothing was measured, or many \
measurements contradict each other); 2 an option is wrong, or the cutoff is too high for the rate; 4 the folder cannot be read, a line \
is wrong, or times do not ascend.

With --json, prints one object:
    {\"report\": the content of smooth.json, \"files\": [path], \"has_up\"}

Examples:
    parallax smooth out/run
    parallax smooth out/run --constant-bones --fill-s 0.5
    parallax smooth out/run --method butterworth --cutoff-hz 6")]
pub(crate) struct Arguments {
    /// Folder with the results of a run.
    folder: PathBuf,
    /// The method. `rts` uses later frames, and the measured covariances. `butterworth` is a zero-phase low-pass filter.
    /// `kalman` is the method of live runs. `none` only computes angles.
    #[arg(long, value_name = "METHOD", value_parser = method)]
    method: Option<Method>,
    /// Cutoff frequency of `butterworth`, in Hz. If not given, 6.
    #[arg(long, value_name = "HZ", value_parser = cutoff)]
    cutoff_hz: Option<f64>,
    /// Longest gap to fill, in seconds. If not given, 0.25.
    #[arg(long, value_name = "SECONDS", value_parser = fill)]
    fill_s: Option<f64>,
    /// Keep the bones of the limbs at constant lengths (with `rts`).
    #[arg(long)]
    constant_bones: bool,
    /// Frames per second, in place of the times in the file.
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate_hz: Option<f64>,
    /// Upward direction in the world of the run, in place of the direction in its calibration.
    #[arg(long, value_name = "X,Y,Z", value_parser = super::export::up, allow_hyphen_values = true)]
    up: Option<UnitVector3<f64>>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

fn method(text: &str) -> Result<Method, String> {
    let known = Method::ALL.into_iter().find(|method| method.name() == text);
    known.ok_or_else(|| {
        format!(
            "expected one of {}",
            Method::ALL.map(Method::name).join(", ")
        )
    })
}

fn cutoff(text: &str) -> Result<f64, String> {
    within(text, [0.1, 1000.0])
}

fn fill(text: &str) -> Result<f64, String> {
    within(text, [0.0, 10.0])
}

fn rate(text: &str) -> Result<f64, String> {
    within(text, [0.001, 1e5])
}

fn within(text: &str, [least, most]: [f64; 2]) -> Result<f64, String> {
    let number = text.parse().ok().filter(|value| (least..=most).contains(value));
    number.ok_or_else(|| format!("expected {least} to {most}"))
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let terminal = Terminal::with_bar(globals.quiet, false, BAR);
    let folder = &arguments.folder;
    let request = Request {
        folder: folder.clone(),
        settings: settings(arguments),
        rate_hz: arguments.rate_hz,
        up: arguments.up,
    };
    let outcome = finished::run(&request, &terminal)?;
    if arguments.json {
        output::json(&as_json(&request, &outcome))?;
    } else if !globals.quiet {
        tell(&request, &outcome)?;
    }
    for it in &outcome.report.doubts {
        output::message(format_args!("doubtful: {it}"));
    }
    if outcome.report.doubts.is_empty() {
        Ok(ExitCode::SUCCESS)
    } else {
        Ok(ExitCode::from(ExitKind::Degraded.status()))
    }
}

/// Returns the settings: the values of the command line, or otherwise the defaults.
fn settings(arguments: &Arguments) -> Settings {
    let defaults = Settings::default();
    Settings {
        method: arguments.method.unwrap_or(defaults.method),
        cutoff_hz: arguments.cutoff_hz.unwrap_or(defaults.cutoff_hz),
        fill_s: arguments.fill_s.unwrap_or(defaults.fill_s),
        constant_bones: arguments.constant_bones,
    }
}

fn as_json(request: &Request, outcome: &Outcome) -> Value {
    let files = finished::FILES.map(|file| request.folder.join(file));
    json!({
        "report": outcome.report,
        "files": files,
        "has_up": outcome.has_up,
    })
}

fn tell(request: &Request, outcome: &Outcome) -> Result<(), Failure> {
    let report = &outcome.report;
    let people = report.people.iter();
    let n_joints = people.map(|person| person.joints.len()).max().unwrap_or(0);
    let of = match report.people.len() {
        0 | 1 => String::new(),
        n => format!(" of {n} people"),
    };
    output::line(format_args!(
        "{} over {} frames{of} with {n_joints} joints, delay {:.0} ms",
        report.method, report.n_frames, report.delay_ms
    ))?;
    let counts: Vec<String> =
        finished::totals(report).iter().map(|(name, n)| format!("{n} {name}")).collect();
    output::line(format_args!("positions: {}", counts.join(", ")))?;
    let joints = report.people.iter().flat_map(|person| person.joints.values());
    let scales: Vec<f64> = joints.filter_map(|joint| joint.covariance_scale).collect();
    let scale = statistics::Sorted::new(scales).interpolated(0.5);
    if let Some(scale) = scale {
        let sd = scale.sqrt();
        output::line(format_args!(
            "errors from frame to frame are {sd:.2} times as large as the covariances predict (median of the joints)"
        ))?;
    }
    let breaks = report.people.iter().map(|person| &person.frames_of_breaks);
    for frames in breaks.filter(|frames| !frames.is_empty()) {
        output::line(format_args!(
            "the followed person changes in {} frames: {frames:?}",
            frames.len()
        ))?;
    }
    if !outcome.has_up {
        output::line(
            "angles with the vertical are missing, because the calibration does not define the upward direction; use --up X,Y,Z",
        )?;
    }
    for name in finished::FILES {
        output::message(format_args!(
            "wrote {}",
            request.folder.join(name).display()
        ));
    }
    Ok(())
}
