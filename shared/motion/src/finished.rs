//! Smooths a finished run, and writes `pose3d-smooth.jsonl`, `smooth.json` and `angles.csv`.
//!
//! The measurements are read line by line, and are read again while the result is written. So the required memory does not grow with the
//! other content of the lines.

mod folder;
mod settings;
mod write;

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::live;
use crate::{Motion, Recorded, Report, butterworth};
use failure::{Console, ExitKind, Failure};
use nalgebra::UnitVector3;
use runfiles::{SmoothReport, SmoothedJoint, SmoothedPerson, Unsure};

pub use folder::{Person, Run, read, read_lines};
pub use settings::{Method, Settings};

/// The reason to doubt the result that is reported if there is nothing to smooth.
const NOTHING_MEASURED: &str = "no joint was measured in any frame";

/// The files that are written beside the results.
pub const FILES: [&str; 3] = ["pose3d-smooth.jsonl", "angles.csv", "smooth.json"];

/// Request to smooth a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Folder with the results of a run.
    pub folder: PathBuf,
    /// Settings of the smoothing.
    pub settings: Settings,
    /// Frame rate, in frames per second; if set, it replaces the times in the file.
    pub rate_hz: Option<f64>,
    /// Upward direction; if set, it replaces the direction from the calibration.
    pub up: Option<UnitVector3<f64>>,
}

/// Outcome of a request.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Content of `smooth.json`.
    pub report: SmoothReport,
    /// True if the vertical was known, which some angles need.
    pub has_up: bool,
}

/// Smooths a run, and writes the files beside its results.
///
/// # Errors
///
/// Fails if a file cannot be read or written, if a line is invalid, if the times do not ascend, or if the cutoff is too high for the frame
/// rate.
pub fn run(request: &Request, console: &dyn Console) -> Result<Outcome, Failure> {
    console.begin("", "reading");
    let run = read(&request.folder, request.rate_hz)?;
    console.begin("", "smoothing");
    let people = run.people.iter();
    let motions: Result<Vec<Motion>, Failure> =
        people.map(|person| smoothed(&person.recorded, &request.settings)).collect();
    let motions = motions?;
    let up = request.up.or_else(|| folder::up(&request.folder));
    let mut report = report(&run, &motions, &request.settings);
    report.doubts = doubts(run.cut.as_deref(), &report);
    console.begin("", "writing");
    write::all(&request.folder, &run, &motions, &report, up)?;
    console.finish();
    Ok(Outcome {
        report,
        has_up: up.is_some(),
    })
}

/// Smooths the joints according to the settings.
///
/// # Errors
///
/// Fails if the cutoff is too high for the frame rate.
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
                    "use a lower --cutoff-hz, or --method rts, which works at any frame rate";
                Failure::new(ExitKind::Usage, error).with_hint(hint)
            })
        }
        Method::Kalman => Ok(live::over(recorded, settings.fill_s)),
        Method::None => Ok(crate::as_measured(recorded)),
    }
}

fn report(run: &Run, motions: &[Motion], settings: &Settings) -> SmoothReport {
    let steps: Vec<f64> = run.times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let step = statistics::Sorted::new(steps).interpolated(0.5);
    let most = |of: &dyn Fn(&Report) -> Option<f64>| {
        let all = motions.iter().filter_map(|motion| of(&motion.report));
        all.reduce(f64::max)
    };
    let delay_s = most(&|report| Some(report.delay_s)).unwrap_or(0.0);
    let has_cutoff = settings.method == Method::Butterworth;
    let people = run.people.iter().zip(motions);
    SmoothReport {
        cutoff_hz: has_cutoff.then_some(settings.cutoff_hz),
        delay_ms: delay_s * 1000.0,
        doubts: Vec::new(),
        fill_s: settings.fill_s,
        method: settings.method.name().to_owned(),
        n_frames: run.frames.len() as u64,
        people: people
            .map(|(person, motion)| person_report(person, &run.frames, &motion.report))
            .collect(),
        rate_hz: step.map(|step_s| 1.0 / step_s),
        resampled_ms: most(&|report| report.resampled_s).map(|s| s * 1000.0),
        schema_version: runfiles::VERSION,
    }
}

fn person_report(person: &Person, frames: &[u64], found: &Report) -> SmoothedPerson {
    let name = |joint: usize| person.recorded.joints[joint].name.clone();
    let joint = |nth: usize| {
        let counts = found.counts[nth];
        let noise = found.noise[nth];
        let joint = SmoothedJoint {
            absent: counts.absent,
            covariance_scale: noise.map(|noise| noise.scale),
            exchanged: counts.exchanged,
            filled: counts.filled,
            jerk_m2_s5: noise.map(|noise| noise.jerk),
            measured: counts.measured,
            rejected: counts.rejected,
        };
        (name(nth), joint)
    };
    let bones = found.bones.iter();
    let bones = bones.map(|([a, b], length)| (format!("{} to {}", name(*a), name(*b)), *length));
    let [kept, exchanged, left_out] = found.unsure;
    SmoothedPerson {
        bones: bones.collect(),
        frames_of_breaks: found.breaks.iter().map(|&at| frames[at]).collect(),
        ids: person.ids.clone(),
        joints: (0..person.recorded.joints.len()).map(joint).collect(),
        unsure: Unsure {
            exchanged,
            kept,
            left_out,
        },
    }
}

/// Returns the reasons to doubt the result. If there are several people, each reason names the person.
fn doubts(cut: Option<&str>, report: &SmoothReport) -> Vec<String> {
    let mut doubts = Vec::new();
    doubts.extend(cut.map(str::to_owned));
    // People whom the run only expected, and never located, have nothing that could be wrong.
    let measured: Vec<&SmoothedPerson> =
        report.people.iter().filter(|person| n_measured(person) > 0).collect();
    if measured.is_empty() {
        doubts.push(NOTHING_MEASURED.to_owned());
    }
    for person in measured {
        let own = doubts_of(person).into_iter();
        if report.people.len() == 1 {
            doubts.extend(own);
        } else {
            doubts.extend(own.map(|doubt| format!("person {:?}: {doubt}", person.ids)));
        }
    }
    doubts
}

/// Returns the number of measured positions of a person.
fn n_measured(person: &SmoothedPerson) -> usize {
    person.joints.values().map(|joint| joint.measured + joint.exchanged).sum()
}

fn doubts_of(person: &SmoothedPerson) -> Vec<String> {
    let mut doubts = Vec::new();
    let n_measured = n_measured(person);
    let n_rejected: usize = person.joints.values().map(|joint| joint.rejected).sum();
    if n_rejected * 5 > n_measured {
        doubts.push(format!(
            "{n_rejected} measurements contradict the measurements before and after them, and only {n_measured} do not: check the \
             measurements first"
        ));
    }
    // Joints without a side are used in every frame with the person.
    let used = person
        .joints
        .values()
        .map(|joint| joint.measured + joint.exchanged + joint.rejected);
    let n_frames = used.max().unwrap_or(0).max(person.unsure.left_out);
    let Unsure {
        kept,
        exchanged,
        left_out,
    } = person.unsure;
    if kept > 0 && kept >= n_frames && exchanged + left_out == 0 {
        doubts.push(
            "left and right are uncertain in every frame, so both sides were kept as measured"
                .to_owned(),
        );
    } else if left_out * 5 > n_frames {
        doubts.push(format!(
            "left and right are uncertain in {left_out} of {n_frames} frames, and the frames before and after do not help to distinguish them"
        ));
    }
    doubts
}

/// Returns counts over all joints, for display.
pub fn totals(report: &SmoothReport) -> BTreeMap<&'static str, usize> {
    let joints = || report.people.iter().flat_map(|person| person.joints.values());
    let sum = |of: fn(&SmoothedJoint) -> usize| joints().map(of).sum::<usize>();
    [
        ("measured", sum(|joint| joint.measured)),
        ("exchanged", sum(|joint| joint.exchanged)),
        ("filled", sum(|joint| joint.filled)),
        ("rejected", sum(|joint| joint.rejected)),
        ("absent", sum(|joint| joint.absent)),
    ]
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_who_were_never_located_are_no_reason_for_doubt_unless_nobody_was() {
        let person = |id: u64, measured: usize, rejected: usize| SmoothedPerson {
            ids: vec![id],
            joints: [(
                "neck".to_owned(),
                SmoothedJoint {
                    measured,
                    rejected,
                    ..SmoothedJoint::default()
                },
            )]
            .into(),
            ..SmoothedPerson::default()
        };
        let doubts = |people: &[SmoothedPerson]| {
            let report = SmoothReport {
                n_frames: 10,
                people: people.to_vec(),
                ..SmoothReport::default()
            };
            doubts(None, &report)
        };
        assert!(doubts(&[person(1, 9, 0), person(3, 0, 0)]).is_empty());
        assert_eq!(
            doubts(&[person(1, 0, 0), person(3, 0, 0)]),
            [NOTHING_MEASURED]
        );
        assert_eq!(doubts(&[]), [NOTHING_MEASURED]);
        let one = doubts(&[person(1, 9, 0), person(3, 5, 4)]);
        assert!(
            one.len() == 1 && one[0].starts_with("person [3]: 4 measurements"),
            "{one:?}"
        );
    }

    #[test]
    fn uncertain_sides_are_compared_with_the_frames_in_which_the_person_is_there() {
        let doubts = |[kept, exchanged, left_out]: [usize; 3]| {
            let neck = SmoothedJoint {
                measured: 10,
                ..SmoothedJoint::default()
            };
            doubts_of(&SmoothedPerson {
                joints: [("neck".to_owned(), neck)].into(),
                unsure: Unsure {
                    exchanged,
                    kept,
                    left_out,
                },
                ..SmoothedPerson::default()
            })
        };
        assert_eq!(doubts([9, 1, 0]), Vec::<String>::new());
        assert_eq!(doubts([2, 6, 2]), Vec::<String>::new());
        assert!(doubts([10, 0, 0])[0].contains("kept as measured"));
        assert!(doubts([0, 0, 3])[0].contains("uncertain in 3 of 10 frames"));
        assert!(doubts([0, 0, 10])[0].contains("uncertain in 10 of 10 frames"));
    }
}
