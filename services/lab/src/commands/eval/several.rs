//! Evaluation of who is who, on a set of several people.

use std::path::Path;
use std::process::ExitCode;

use failure::{ExitKind, Failure, OrFail as _, in_file};
use lab::several::{ActorReport, Measured, Report, Shelf, ShelfError, run as follow};
use terminal::output;

use super::Arguments;

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
    let report = Report::new(&follow(&set.with_views(&views)), &views);
    inputs::make_folder(&arguments.out)?;
    let text = serde_json::to_string_pretty(&report).or_fail(ExitKind::Run)?;
    let file = arguments.out.join("people.json");
    files::replace(&file, text.as_bytes()).map_err(|error| in_file(&file, &error))?;
    if arguments.json {
        output::json(&report)?;
    } else {
        output::line(in_lines(&report))?;
    }
    failure::require_results(
        !report.actors.is_empty(),
        "no frame has anybody in its truth",
    )
}

/// The views that were asked for; all if none was.
fn chosen(asked: &[usize], n_views: usize) -> Result<Vec<usize>, Failure> {
    let is_twice = |nth: usize| asked[..nth].contains(&asked[nth]);
    let wrong = (0..asked.len()).find(|nth| asked[*nth] >= n_views || is_twice(*nth));
    if let Some(wrong) = wrong {
        let message = format!(
            "--views: {} is not one of 0 to {}, or is there twice",
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
    let number = |measured: &Option<Measured>| {
        let Some(Measured { value, interval }) = measured else {
            return "-".to_owned();
        };
        let [low, high] = interval;
        format!("{value:.2} ({low:.2} to {high:.2})")
    };
    let actor = |actor: &ActorReport| {
        let parts: Vec<String> = actor
            .parts
            .iter()
            .map(|(name, share)| format!("{name} {share:.1}"))
            .collect();
        format!(
            "actor {}: found in {} of {} frames, PCP3D {} %, MPJPE {} mm; {}\n",
            actor.actor,
            actor.found,
            actor.frames,
            number(&actor.pcp3d),
            number(&actor.mpjpe_mm),
            parts.join(", ")
        )
    };
    let actors: String = report.actors.iter().map(actor).collect();
    let [median, slow] = report.association_ms;
    format!(
        "{actors}mean of actors 1 to 3: PCP3D {} %\n{} changes of an id, {} ids given, {:.2} people put out a frame of {}\n\
         association: median {median:.2} ms, 99th percentile {slow:.2} ms a frame\n\
         by the protocol and the head rule of 4D Association; intervals: 95 %, over blocks of a second",
        number(&report.mean_pcp3d),
        report.switches,
        report.ids,
        report.put_out,
        report.frames
    )
}
