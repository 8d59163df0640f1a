//! Evaluation of identities on a data set with several people in each frame.

use std::path::Path;
use std::process::ExitCode;

use failure::{ExitKind, Failure, OrFail as _, in_file};
use lab::several::{
    ActorReport, Everybody, Measured, Report, Shelf, ShelfError, as_run, everybody, run as follow,
};
use runfiles::FrameLine;
use scene::truth::{Frame, Header, TruthError};
use serde::Serialize;
use terminal::output;

use super::Arguments;

/// The report of a set.
#[derive(Debug, Serialize)]
struct Both {
    /// With all keypoints of the detector.
    #[serde(flatten)]
    report: Report,
    /// With the steps of `parallax run`.
    as_run: Report,
}

/// Runs the evaluation.
pub(super) fn run(arguments: &Arguments, folder: &Path) -> Result<ExitCode, Failure> {
    let set = Shelf::read(folder).map_err(|error| {
        let kind = match error {
            ShelfError::Calibration { .. } => ExitKind::Calibration,
            _ => ExitKind::Input,
        };
        Failure::new(kind, error)
    })?;
    let views = chosen(&arguments.views, set.cameras.len())?;
    let set = set.with_views(&views);
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let as_run = as_run(&set, &model).or_fail(ExitKind::Input)?;
    let both = Both {
        report: Report::new(&follow(&set), &views),
        as_run: Report::new(&as_run, &views),
    };
    let lines = format!(
        "{}\nas `parallax run` solves the same people from keypoint files, without the keypoints that belong to nobody:\n{}",
        in_lines(&both.report),
        in_lines(&both.as_run)
    );
    leave(arguments, &both, &lines)?;
    failure::require_results(
        !both.report.actors.is_empty(),
        "the truth has no person in any frame",
    )
}

/// Evaluates a finished run against the truth of its scene.
///
/// * `run`: folder with the results of the run.
pub(super) fn run_of_scene(arguments: &Arguments, run: &Path) -> Result<ExitCode, Failure> {
    let [folder] = &arguments.sequences[..] else {
        let what = "--run evaluates one run against the truth of one sequence";
        return Err(Failure::new(ExitKind::Usage, what));
    };
    let file = folder.join("truth.jsonl");
    let text = failure::read_text(&file)?;
    let refuse = |line: usize, error: &TruthError| {
        let what = format!("{}, line {line}: {error}", file.display());
        Failure::new(ExitKind::Input, what)
            .with_hint("--run evaluates a run of a folder that `parallax-lab synth` wrote")
    };
    let mut lines = text.lines();
    let header = Header::parse(lines.next().unwrap_or_default());
    let header = header.map_err(|error| refuse(1, &error))?;
    let frames = lines
        .enumerate()
        .map(|(nth, line)| Frame::parse(line, &header).map_err(|error| refuse(nth + 2, &error)));
    let truth: Vec<Frame> = frames.collect::<Result<_, Failure>>()?;
    let file = run.join("pose3d.jsonl");
    let text = failure::read_text(&file)?;
    let lines: Result<Vec<FrameLine>, _> = runfiles::lines(&text).collect();
    let lines = lines.map_err(|error| in_file(&file, &error))?;
    let report = everybody(&truth, &lines, header.frame_rate_hz);
    leave(arguments, &report, &everybody_in_lines(&report))?;
    failure::require_results(
        report.frames > 0,
        "the run and the truth have no frame in common: check that they belong to the same scene",
    )
}

/// Writes a report into the output folder, and prints it.
fn leave(arguments: &Arguments, report: &impl Serialize, lines: &str) -> Result<(), Failure> {
    inputs::make_folder(&arguments.out)?;
    let text = serde_json::to_string_pretty(report).or_fail(ExitKind::Run)?;
    let file = arguments.out.join("people.json");
    files::replace(&file, text.as_bytes()).map_err(|error| in_file(&file, &error))?;
    if arguments.json {
        output::json(report)
    } else {
        output::line(lines)
    }
}

fn everybody_in_lines(report: &Everybody) -> String {
    let people = report.people.iter().map(|person| {
        format!(
            "person {}: found in {} of {} frames, PCP3D {} %, limbs off by {} mm, {} id changes\n",
            person.actor,
            person.found,
            person.frames,
            number(person.pcp3d),
            number(person.mpjpe_mm),
            person.switches
        )
    });
    let people: String = people.collect();
    let ap = report.ap.iter().map(|(mm, ap)| format!("{ap:.1} at {mm} mm"));
    format!(
        "{people}all people: mean error of 14 joints {} mm, recall at 500 mm {:.1} %, average precision {} %\n\
         {} id changes ({:.2} per minute), {} different ids, {:.2} people found per frame, {:.2} present, {} frames; intervals: 95 %, over \
         blocks of 25 frames",
        number(report.mpjpe_mm),
        report.recall,
        ap.collect::<Vec<_>>().join(", "),
        report.switches,
        report.switches_a_minute,
        report.ids,
        report.put_out,
        report.there,
        report.frames
    )
}

/// Formats a number with its interval.
fn number(measured: Option<Measured>) -> String {
    let Some(Measured { value, interval }) = measured else {
        return "-".to_owned();
    };
    let [low, high] = interval;
    format!("{value:.2} ({low:.2} to {high:.2})")
}

/// Returns the selected views; all views if the selection is empty.
fn chosen(asked: &[usize], n_views: usize) -> Result<Vec<usize>, Failure> {
    let is_twice = |nth: usize| asked[..nth].contains(&asked[nth]);
    let wrong = (0..asked.len()).find(|nth| asked[*nth] >= n_views || is_twice(*nth));
    if let Some(wrong) = wrong {
        let message = format!(
            "--views: {} is given twice, or is not a number from 0 to {}",
            asked[wrong],
            n_views.saturating_sub(1)
        );
        return Err(Failure::new(ExitKind::Usage, message));
    }
    Ok(if asked.is_empty() {
        (0..n_views).collect()
    } else {
        asked.to_vec()
    })
}

fn in_lines(report: &Report) -> String {
    let actor = |actor: &ActorReport| {
        let parts: Vec<String> =
            actor.parts.iter().map(|(name, share)| format!("{name} {share:.1}")).collect();
        format!(
            "actor {}: found in {} of {} frames, PCP3D {} %, MPJPE {} mm; {}\n",
            actor.actor,
            actor.found,
            actor.frames,
            number(actor.pcp3d),
            number(actor.mpjpe_mm),
            parts.join(", ")
        )
    };
    let actors: String = report.actors.iter().map(actor).collect();
    let [median, slow] = report.association_ms;
    format!(
        "{actors}mean of actors 1 to 3: PCP3D {} %\n{} id changes, {} different ids, {:.2} people found per frame in {} frames\n\
         association: median {median:.2} ms, 99th percentile {slow:.2} ms per frame\n\
         evaluated with the protocol and the head rule of 4D Association; intervals: 95 %, over blocks of a second",
        number(report.mean_pcp3d),
        report.switches,
        report.ids,
        report.put_out,
        report.frames
    )
}
