//! A finished run smoothed: `pose3d-smooth.jsonl`, `smooth.json`, `angles.csv`.
//!
//! What was measured is read line by line, and read again as the result is written, so that the memory that is needed
//! does not grow with what else stands in a line.

mod folder;
mod settings;
mod write;

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::live;
use crate::{Motion, Recorded, Report, butterworth};
use failure::{Console, ExitKind, Failure};
use nalgebra::UnitVector3;
use runfiles::{SmoothReport, SmoothedJoint, Unsure};

pub use folder::{Run, read, read_lines};
pub use settings::{Method, Settings};

/// The files that are written beside the results.
pub const FILES: [&str; 3] = ["pose3d-smooth.jsonl", "angles.csv", "smooth.json"];

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The results of a run.
    pub folder: PathBuf,
    /// How to smooth.
    pub settings: Settings,
    /// Frames per second, in place of the times in the file.
    pub rate_hz: Option<f64>,
    /// Against gravity, in place of what the calibration says.
    pub up: Option<UnitVector3<f64>>,
}

/// What became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// What `smooth.json` holds.
    pub report: SmoothReport,
    /// What was measured.
    pub recorded: Recorded,
    /// The number of the frame of every instant.
    pub frames: Vec<u64>,
    /// Whether a vertical was known for angles with it.
    pub has_up: bool,
}

/// Smooths a run, and writes the files beside its results.
///
/// # Errors
///
/// Files that cannot be read or written, lines that are none, times that do not ascend, a cutoff above what the rate allows.
pub fn run(request: &Request, console: &dyn Console) -> Result<Outcome, Failure> {
    console.begin("", "reading");
    let run = read(&request.folder, request.rate_hz)?;
    console.begin("", "smoothing");
    let motion = smoothed(&run.recorded, &request.settings)?;
    let up = request.up.or_else(|| folder::up(&request.folder));
    let mut report = report(
        &run.recorded,
        &run.frames,
        &motion.report,
        &request.settings,
    );
    report.doubts = doubts(&run, &report);
    console.begin("", "writing");
    write::all(&request.folder, &run, &motion, &report, up)?;
    console.finish();
    Ok(Outcome {
        report,
        recorded: run.recorded,
        frames: run.frames,
        has_up: up.is_some(),
    })
}

/// The joints, smoothed as the settings say.
///
/// # Errors
///
/// A cutoff above what the rate allows.
pub fn smoothed(recorded: &Recorded, settings: &Settings) -> Result<Motion, Failure> {
    let of_rts = crate::Settings {
        fill_s: settings.fill_s,
        constant_bones: settings.constant_bones,
    };
    match settings.method {
        Method::Rts => Ok(crate::smooth(recorded, &of_rts)),
        Method::Butterworth => {
            let filtered = butterworth::filter(recorded, settings.cutoff_hz, settings.fill_s);
            filtered.map_err(|error| {
                let hint =
                    "a lower --cutoff-hz, or --method rts, which follows the data at any rate";
                Failure::new(ExitKind::Usage, error).with_hint(hint)
            })
        }
        Method::Kalman => Ok(live::over(recorded, settings.fill_s)),
        Method::None => Ok(crate::as_measured(recorded)),
    }
}

fn report(
    recorded: &Recorded,
    frames: &[u64],
    found: &Report,
    settings: &Settings,
) -> SmoothReport {
    let name = |joint: usize| recorded.joints[joint].name.clone();
    let joint = |nth: usize| {
        let counts = found.counts[nth];
        let noise = found.noise[nth];
        let joint = SmoothedJoint {
            absent: counts.absent,
            covariance_scale: noise.map(|it| it.scale),
            exchanged: counts.exchanged,
            filled: counts.filled,
            jerk_m2_s5: noise.map(|it| it.jerk),
            measured: counts.measured,
            rejected: counts.rejected,
        };
        (name(nth), joint)
    };
    let bones = found.bones.iter();
    let bones = bones.map(|([a, b], length)| (format!("{} to {}", name(*a), name(*b)), *length));
    let steps: Vec<f64> = recorded.times.windows(2).map(|it| it[1] - it[0]).collect();
    let step = statistics::Sorted::new(steps).interpolated(0.5);
    let [kept, exchanged, left_out] = found.unsure;
    let has_cutoff = settings.method == Method::Butterworth;
    SmoothReport {
        bones: bones.collect(),
        cutoff_hz: has_cutoff.then_some(settings.cutoff_hz),
        delay_ms: found.delay_s * 1000.0,
        doubts: Vec::new(),
        fill_s: settings.fill_s,
        frames_of_breaks: found.breaks.iter().map(|&it| frames[it]).collect(),
        joints: (0..recorded.joints.len()).map(joint).collect(),
        method: settings.method.name().to_owned(),
        n_frames: frames.len() as u64,
        rate_hz: step.map(|it| 1.0 / it),
        resampled_ms: found.resampled_s.map(|it| it * 1000.0),
        schema_version: runfiles::VERSION,
        unsure: Unsure {
            exchanged,
            kept,
            left_out,
        },
    }
}

/// What speaks against trusting the result.
fn doubts(run: &Run, report: &SmoothReport) -> Vec<String> {
    let mut doubts = Vec::new();
    doubts.extend(run.cut.clone());
    let sum = |of: fn(&SmoothedJoint) -> usize| report.joints.values().map(of).sum::<usize>();
    let n_measured = sum(|it| it.measured) + sum(|it| it.exchanged);
    let n_rejected = sum(|it| it.rejected);
    if n_measured == 0 {
        doubts.push("no joint was measured in any frame".to_owned());
    } else if n_rejected * 5 > n_measured {
        doubts.push(format!(
            "{n_rejected} measurements contradict those before and after, {n_measured} do not: look at what was measured first"
        ));
    }
    let n_unsure = report.unsure.kept + report.unsure.exchanged + report.unsure.left_out;
    if n_unsure > 0 && n_unsure == report.n_frames as usize {
        doubts.push(
            "left and right are not certain in any frame, and were taken as they are".to_owned(),
        );
    } else if report.unsure.left_out * 5 > report.n_frames as usize {
        doubts.push(format!(
            "left and right are not certain in {} of {} frames, nor decided by those before and after",
            report.unsure.left_out, report.n_frames
        ));
    }
    doubts
}

/// Counts of all joints together, for people.
pub fn totals(report: &SmoothReport) -> BTreeMap<&'static str, usize> {
    let sum = |of: fn(&SmoothedJoint) -> usize| report.joints.values().map(of).sum::<usize>();
    [
        ("measured", sum(|it| it.measured)),
        ("exchanged", sum(|it| it.exchanged)),
        ("filled", sum(|it| it.filled)),
        ("rejected", sum(|it| it.rejected)),
        ("absent", sum(|it| it.absent)),
    ]
    .into()
}
