//! Single pictures of annotated people: PARSE, LSP, and JSON lines.

use std::fmt::Write as _;
use std::path::Path;

use crate::evaluation::page::pictures_html;
use crate::evaluation::{Intervals, Judged, Pictures, pictures_latex};
use failure::{ExitKind, Failure, OrFail as _, in_file};
use serde_json::{Value, json};
use statistics::score::Bootstrap;
use training::datasets::People;

use crate::judged;

/// Returns true if the files in a path are a data set of single pictures.
pub fn is_one(path: &Path) -> bool {
    if path.is_dir() {
        let has = |name: &str| path.join(name).is_file();
        return has("labels.mat") || has("joints.mat");
    }
    let ending = path.extension().unwrap_or_default();
    ending == "jsonl" || ending == "mat"
}

/// Returns the last component of a path. If it is a file with a standard name, the component before it is included.
pub fn name(path: &Path) -> String {
    let is_known = path
        .file_name()
        .is_some_and(|name| name == "labels.mat" || name == "joints.mat");
    let place = if is_known { path.parent() } else { Some(path) };
    let stem = place.and_then(Path::file_stem).unwrap_or_default();
    let stem = stem.to_string_lossy().into_owned();
    if stem.is_empty() || stem == ".." {
        "pictures".to_owned()
    } else {
        stem
    }
}

/// Writes the results on a data set, one line per person.
///
/// * `folder`: folder of the file. The file has the name of the data set.
///
/// # Errors
///
/// Fails if the file cannot be written.
pub fn write_found(folder: &Path, people: &People, set: &Pictures) -> Result<(), Failure> {
    let file = folder.join(format!("{}.jsonl", set.name));
    put(&file, &lines(people, set))
}

/// Returns the joints that were found, one line per person.
fn lines(people: &People, set: &Pictures) -> String {
    let each = people.people.iter().zip(&set.found);
    let mut text = String::new();
    for (person, [best, on_person]) in each {
        let line = json!({ "image": person.image, "best": best, "on_person": on_person });
        // Writing to a string cannot fail.
        let _infallible = writeln!(text, "{line}");
    }
    text
}

/// Writes `report.json`, `report.html` and `report.tex`.
///
/// * `out`: folder for these files.
/// * `model`: name of the model, for readers of the report.
/// * Returns the numbers, as in `report.json`.
///
/// # Errors
///
/// Fails if a file cannot be written.
pub fn write_report(
    out: &Path,
    model: &str,
    sets: &[Pictures],
    bootstrap: &Bootstrap,
) -> Result<Value, Failure> {
    let numbers = json!({
        "schema_version": 1,
        "confidence": bootstrap.confidence,
        "pictures": sets.iter().map(|set| numbers(set, bootstrap)).collect::<Vec<_>>(),
    });
    let json = serde_json::to_string_pretty(&numbers).or_fail(ExitKind::Run)?;
    let page = pictures_html(sets, &about(model, sets), bootstrap);
    let tables = pictures_latex(sets, bootstrap);
    for (name, text) in [
        ("report.json", &json),
        ("report.html", &page),
        ("report.tex", &tables),
    ] {
        put(&out.join(name), text)?;
    }
    Ok(numbers)
}

/// Returns the numbers of one data set as JSON, in the same form as `judge` prints, with confidence intervals.
fn numbers(set: &Pictures, bootstrap: &Bootstrap) -> Value {
    let of = |which: Judged| {
        let mut value = judged::numbers(&set.report(which));
        let Intervals { pcp, pck } = set.intervals(which, bootstrap);
        value["intervals"] = json!({
            "pcp": { "mean_of_ends": pcp[0], "both_ends": pcp[1] },
            "pck": { "0.1": pck[0], "0.2": pck[1] },
        });
        value
    };
    json!({
        "name": set.name,
        "images": set.truths.len(),
        "left_out": set.n_left_out,
        "best": of(Judged::Best),
        "on_person": of(Judged::OnPerson),
    })
}

fn about(model: &str, sets: &[Pictures]) -> Vec<(String, String)> {
    let pictures = sets.iter().map(|set| {
        let (n, n_left_out) = (set.truths.len(), set.n_left_out);
        format!("{}: {n}, left out {n_left_out}", set.name)
    });
    let pictures: Vec<String> = pictures.collect();
    vec![
        ("model".to_owned(), model.to_owned()),
        ("pictures".to_owned(), pictures.join("; ")),
    ]
}

fn put(file: &Path, text: &str) -> Result<(), Failure> {
    files::replace(file, text.as_bytes()).map_err(|error| in_file(file, &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_data_set_is_named_after_its_folder_or_file() {
        for (path, expected) in [
            ("../shared/parse", "parse"),
            ("lsp/joints.mat", "lsp"),
            ("out/people.jsonl", "people"),
            ("..", "pictures"),
        ] {
            assert_eq!(name(Path::new(path)), expected);
        }
    }
}
