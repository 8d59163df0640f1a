//! What is left behind: the report for people, for programs and for papers.

use std::fs;

use evaluation::Bootstrap;
use experiment::{FrameScore, Group, Measured, Summary, judge, latex, score, summarise};
use report::evaluation::{Page, html};
use runtime::{ExitKind, Failure, OrFail as _};

use super::Arguments;
use super::job::{Done, Job};
use crate::{inputs, output};

/// Writes the report, and prints its short form.
pub(super) fn write(arguments: &Arguments, job: &Job, done: &Done) -> Result<(), Failure> {
    let bootstrap = Bootstrap {
        block: arguments.block,
        ..Bootstrap::default()
    };
    let versions: Vec<String> = job.versions.iter().map(ToString::to_string).collect();
    let records = done.sequences.iter().flat_map(|it| &it.1);
    let predicted: Vec<_> = records
        .flat_map(|it| it.predicted.iter().flatten())
        .collect();
    let summary = Summary {
        predictions: judge(&predicted),
        ..summarise(&measured(done), &versions, &bootstrap)
    };
    let json = serde_json::to_string_pretty(&summary).or_fail(ExitKind::Run)?;
    let about = about(arguments, job, done);
    let page = html(&Page {
        summary: &summary,
        versions: &job.versions,
        about: &about,
    });
    for (name, text) in [
        ("report.json", json),
        ("report.html", page),
        ("report.tex", latex(&summary, &job.versions)),
    ] {
        let file = arguments.out.join(name);
        fs::write(&file, text).map_err(|error| inputs::in_file(&file, &error))?;
    }
    if arguments.json {
        return output::json(&summary);
    }
    print(&summary, job)?;
    output::line(format_args!(
        "report: {}",
        arguments.out.join("report.html").display()
    ))
}

fn measured(done: &Done) -> Vec<Measured> {
    let mut all = Vec::new();
    for (sequence, records) in &done.sequences {
        let mut scores: Vec<Vec<FrameScore>> = Vec::new();
        for frame in &sequence.frames {
            if let Some(record) = records.iter().find(|it| it.frame == frame.number) {
                let found = record.found.iter();
                scores.push(found.map(|it| score(sequence, frame, it)).collect());
            }
        }
        all.push(Measured {
            dataset: sequence.dataset.clone(),
            subject: sequence.subject.clone(),
            action: sequence.action.clone(),
            scores,
        });
    }
    all
}

fn about(arguments: &Arguments, job: &Job, done: &Done) -> Vec<(String, String)> {
    let n_frames: usize = done.sequences.iter().map(|it| it.1.len()).sum();
    let file = arguments.sigma.as_ref().or(arguments.network.as_ref());
    let expected = match (file, arguments.oracle) {
        (Some(file), _) => file.display().to_string(),
        (None, true) => "the true errors, a tenth of the person's size allowed".to_owned(),
        (None, false) => "none".to_owned(),
    };
    let size = arguments.size.map_or_else(
        || format!("{} of the footage", arguments.scale),
        |[width, height]| format!("{width}x{height}"),
    );
    let frames = format!("{n_frames} instants; sequences: {}", done.sequences.len());
    let settings = fuse::settings(&job.config, job.n_candidates, 1.0, job.learned.as_ref());
    let model = arguments.model.as_ref();
    let model = model.map_or("the one that ships".to_owned(), |it| {
        it.display().to_string()
    });
    let upright = if job.film.upright { ", upright" } else { "" };
    [
        ("model", model),
        ("frames", format!("{frames}, {size}{upright}")),
        ("expected errors", expected),
        (
            "energy",
            format!(
                "{}, alpha {}, beta {}, distances {}",
                match job.config.energy {
                    deployment::fuse::Energy::Paper => "the paper's",
                    deployment::fuse::Energy::Released => "that of the released program",
                },
                settings.alpha,
                settings.beta,
                if settings.max_distance_cells.is_finite() {
                    format!("up to {} cells", settings.max_distance_cells)
                } else {
                    "of any number of cells".to_owned()
                }
            ),
        ),
        (
            "facing",
            if job.config.facing {
                "decided for every view"
            } else {
                "as the model names its parts"
            }
            .to_owned(),
        ),
        ("candidates of a view", job.n_candidates.to_string()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .to_vec()
}

/// PCP3D of every group, and the gain over the first version.
fn print(summary: &Summary, job: &Job) -> Result<(), Failure> {
    let mut head = vec![format!("{:<28} {:>6}", "PCP3D at 0.5, %", "frames")];
    head.extend(
        job.versions
            .iter()
            .map(|it| format!("{:>22}", it.to_string())),
    );
    output::line(head.join(" "))?;
    for group in &summary.groups {
        output::line(row(group))?;
    }
    if let Some(it) = summary.predictions.first() {
        let number = |it: Option<f64>| it.map_or_else(|| "-".to_owned(), |it| format!("{it:.3}"));
        let [auc, correlation] = [it.auc, it.rank_correlation].map(number);
        output::line(format_args!(
            "expected errors, mean over parts: area under the ROC {auc}, rank correlation {correlation}"
        ))?;
    }
    Ok(())
}

fn row(group: &Group) -> String {
    let name = [&group.dataset, &group.subject, &group.action].map(String::as_str);
    let name: Vec<&str> = name.into_iter().filter(|it| !it.is_empty()).collect();
    let mut row = vec![format!("{:<28} {:>6}", name.join(" "), group.frames)];
    for it in &group.versions {
        let gain = it
            .gain
            .map_or_else(String::new, |it| format!(" ({it:+.2})"));
        let value = it.pcp3d.map(|it| format!("{it:.2}{gain}"));
        row.push(format!("{:>22}", value.unwrap_or_else(|| "-".to_owned())));
    }
    row.join(" ")
}
