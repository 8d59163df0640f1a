//! Single pictures of annotated people: PARSE, LSP, and JSON lines of one's own.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::ExitCode;

use datasets::People;
use evaluation::Bootstrap;
use experiment::{Intervals, Judged, Pictures, pictures_latex};
use fmp::Search;
use offline::judged;
use report::evaluation::pictures_html;
use runtime::{ExitKind, Failure, OrFail as _, Stop};
use serde_json::{Value, json};

use super::Arguments;
use crate::commands::judge;
use crate::{inputs, output};

/// Whether a path is a data set of single pictures, by what lies there.
pub(super) fn is_one(path: &Path) -> bool {
    if path.is_dir() {
        let has = |name: &str| path.join(name).is_file();
        return has("labels.mat") || has("joints.mat");
    }
    let ending = path.extension().unwrap_or_default();
    ending == "jsonl" || ending == "mat"
}

/// Evaluates.
pub(super) fn run(arguments: &Arguments, stop: &Stop) -> Result<ExitCode, Failure> {
    refuse_what_has_no_meaning(arguments)?;
    let options = judge::options(arguments.only.as_ref(), arguments.without.as_ref());
    let mut all: Vec<(String, People)> = Vec::new();
    for path in &arguments.sequences {
        let name = name(path);
        if all.iter().any(|it| it.0 == name) {
            let message = format!("{name} is given twice");
            return Err(Failure::new(ExitKind::Usage, message));
        }
        let people = datasets::read(path, &options).map_err(offline::dataset_failure)?;
        all.push((name, people));
    }
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let file = arguments.model.as_ref();
    let file = file.map_or_else(|| "the model".to_owned(), |it| it.display().to_string());
    judged::check(&model, &file)?;
    let poses = arguments.out.join("poses");
    inputs::make_folder(&poses)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(arguments.threads.map_or(0, usize::from))
        .build()
        .or_fail(ExitKind::Run)?;
    let search = Search::new(model);
    let mut sets = Vec::new();
    for (name, people) in &all {
        let found = pool.install(|| {
            judged::judged(
                &search,
                name,
                people,
                || stop.is_requested(),
                |text| output::message(text),
            )
        });
        let set = found?;
        let file = poses.join(format!("{name}.jsonl"));
        put(&file, &lines(people, &set))?;
        sets.push(set);
    }
    write(arguments, &sets)?;
    Ok(ExitCode::SUCCESS)
}

/// The last word of a path, with that before where it is a file of a known name.
fn name(path: &Path) -> String {
    let is_known = path
        .file_name()
        .is_some_and(|it| it == "labels.mat" || it == "joints.mat");
    let place = if is_known { path.parent() } else { Some(path) };
    let stem = place.and_then(Path::file_stem).unwrap_or_default();
    let stem = stem.to_string_lossy().into_owned();
    if stem.is_empty() || stem == ".." {
        "pictures".to_owned()
    } else {
        stem
    }
}

/// Refuses options of sequences.
fn refuse_what_has_no_meaning(arguments: &Arguments) -> Result<(), Failure> {
    let it = arguments;
    let given = [
        ("--versions", !it.versions.is_empty()),
        ("--fuse", it.fuse.is_some()),
        ("--consistency", it.consistency.is_some()),
        ("--sigma", it.sigma.is_some()),
        ("--network", it.network.is_some()),
        ("--oracle", it.oracle),
        ("--size", it.size.is_some()),
        ("--scale", it.scale != 1.0),
        ("--every", it.every != 1),
        ("--frames", it.frames.is_some()),
        ("--share", it.share.is_some()),
        ("--umpm-late", it.umpm_late),
        ("--resume", it.resume),
    ];
    match given.iter().find(|it| it.1) {
        None => Ok(()),
        Some((option, _)) => {
            let message = format!("{option} has no meaning for single pictures");
            Err(Failure::new(ExitKind::Usage, message))
        }
    }
}

/// What was found, a line a person.
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

fn write(arguments: &Arguments, sets: &[Pictures]) -> Result<(), Failure> {
    let bootstrap = Bootstrap {
        block: arguments.block,
        ..Bootstrap::default()
    };
    let numbers = json!({
        "schema_version": 1,
        "confidence": bootstrap.confidence,
        "pictures": sets.iter().map(|it| numbers(it, &bootstrap)).collect::<Vec<_>>(),
    });
    let json = serde_json::to_string_pretty(&numbers).or_fail(ExitKind::Run)?;
    let page = pictures_html(sets, &about(arguments, sets), &bootstrap);
    let tables = pictures_latex(sets, &bootstrap);
    for (name, text) in [
        ("report.json", &json),
        ("report.html", &page),
        ("report.tex", &tables),
    ] {
        put(&arguments.out.join(name), text)?;
    }
    if arguments.json {
        return output::json(&numbers);
    }
    for set in sets {
        for which in Judged::ALL {
            let (name, title, report) = (&set.name, which.title(), set.report(which));
            output::line(format_args!("{name}, {title}: {report}\n"))?;
        }
    }
    let report = arguments.out.join("report.html");
    output::line(format_args!("report: {}", report.display()))
}

/// One data set for programs: as `model judge` has it, with intervals.
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

fn about(arguments: &Arguments, sets: &[Pictures]) -> Vec<(String, String)> {
    let model = arguments.model.as_ref();
    let model = model.map_or("the one that ships".to_owned(), |it| {
        it.display().to_string()
    });
    let pictures = sets.iter().map(|it| {
        let (n, n_left_out) = (it.truths.len(), it.n_left_out);
        format!("{}: {n}, left out {n_left_out}", it.name)
    });
    let pictures: Vec<String> = pictures.collect();
    vec![
        ("model".to_owned(), model),
        ("pictures".to_owned(), pictures.join("; ")),
    ]
}

fn put(file: &Path, text: &str) -> Result<(), Failure> {
    fs::write(file, text).map_err(|error| inputs::in_file(file, &error))
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
