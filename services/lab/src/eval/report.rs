//! Reports as HTML, JSON and LaTeX.

use std::path::Path;

use crate::evaluation::page::{Page, html};
use crate::evaluation::{
    FrameScore, Group, Measured, Summary, Version, judge, latex, score, summarise,
};
use failure::{ExitKind, Failure, OrFail as _, in_file};
use statistics::score::Bootstrap;

use super::Done;

impl Done {
    /// Scores the results.
    ///
    /// * `versions`: the compared versions.
    pub fn summary(&self, versions: &[Version], bootstrap: &Bootstrap) -> Summary {
        let versions: Vec<String> = versions.iter().map(ToString::to_string).collect();
        let records = self.sequences.iter().flat_map(|sequence| &sequence.1);
        let predicted: Vec<_> =
            records.flat_map(|record| record.predicted.iter().flatten()).collect();
        Summary {
            predictions: judge(&predicted),
            ..summarise(&measured(self), &versions, bootstrap)
        }
    }
}

/// Writes `report.json`, `report.html` and `report.tex`.
///
/// * `out`: folder for these files.
/// * `about`: description of the evaluation for readers, as names and values.
///
/// # Errors
///
/// Fails if a file cannot be written.
pub fn write_report(
    out: &Path,
    summary: &Summary,
    versions: &[Version],
    about: &[(String, String)],
) -> Result<(), Failure> {
    let json = serde_json::to_string_pretty(summary).or_fail(ExitKind::Run)?;
    let page = html(&Page {
        summary,
        versions,
        about,
    });
    for (name, text) in [
        ("report.json", json),
        ("report.html", page),
        ("report.tex", latex(summary, versions)),
    ] {
        let file = out.join(name);
        files::replace(&file, text.as_bytes()).map_err(|error| in_file(&file, &error))?;
    }
    Ok(())
}

fn measured(done: &Done) -> Vec<Measured> {
    let mut all = Vec::new();
    for (sequence, records) in &done.sequences {
        let mut scores: Vec<Vec<FrameScore>> = Vec::new();
        for frame in &sequence.frames {
            if let Some(record) = records.iter().find(|record| record.frame == frame.number) {
                let found = record.found.iter();
                scores.push(found.map(|result| score(sequence, frame, result)).collect());
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

/// Returns a short text report: PCP3D of every group, and the gain over the first version.
pub fn text(summary: &Summary, versions: &[Version]) -> String {
    let mut head = vec![format!("{:<28} {:>6}", "PCP3D at 0.5, %", "frames")];
    head.extend(versions.iter().map(|version| format!("{:>22}", version.to_string())));
    let mut lines = vec![head.join(" ")];
    lines.extend(summary.groups.iter().map(row));
    if let Some(it) = summary.predictions.first() {
        let number = |value: Option<f64>| {
            value.map_or_else(|| "-".to_owned(), |number| format!("{number:.3}"))
        };
        let [auc, correlation] = [it.auc, it.rank_correlation].map(number);
        lines.push(format!(
            "expected errors, mean over parts: area under the ROC curve {auc}, rank correlation {correlation}"
        ));
    }
    lines.join("\n")
}

fn row(group: &Group) -> String {
    let name = [&group.dataset, &group.subject, &group.action].map(String::as_str);
    let name: Vec<&str> = name.into_iter().filter(|name| !name.is_empty()).collect();
    let mut row = vec![format!("{:<28} {:>6}", name.join(" "), group.frames)];
    for it in &group.versions {
        let gain = it.gain.map_or_else(String::new, |gain| format!(" ({gain:+.2})"));
        let value = it.pcp3d.map(|pcp3d| format!("{pcp3d:.2}{gain}"));
        row.push(format!("{:>22}", value.unwrap_or_else(|| "-".to_owned())));
    }
    row.join(" ")
}
