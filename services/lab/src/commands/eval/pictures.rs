//! Evaluation on single pictures of annotated people: PARSE, LSP, and JSON lines.

use std::process::ExitCode;

use failure::{ExitKind, Failure, Stop};
use fmp::Search;
use lab::eval::pictures;
use lab::evaluation::{Judged, Pictures};
use lab::judged::{self, Reader};
use skeleton::PARSE14;
use statistics::score::Bootstrap;
use terminal::{Globals, Terminal, output};
use training::datasets::People;

use super::Arguments;
use crate::commands::judge;
use crate::commands::pool;

/// Runs the evaluation.
pub(super) fn run(
    arguments: &Arguments,
    globals: Globals,
    stop: &Stop,
) -> Result<ExitCode, Failure> {
    refuse_sequence_options(arguments)?;
    let options = judge::options(arguments.only.as_ref(), arguments.without.as_ref());
    let mut all: Vec<(String, People)> = Vec::new();
    for path in &arguments.sequences {
        let name = pictures::name(path);
        if all.iter().any(|known| known.0 == name) {
            let message = format!("{name} is given twice");
            return Err(Failure::new(ExitKind::Usage, message));
        }
        let people = training::datasets::read(path, &options).map_err(lab::dataset_failure)?;
        all.push((name, people));
    }
    let model = inputs::model_or_shipped(arguments.model.as_deref())?;
    let file = arguments.model.as_ref();
    let file = file.map_or_else(|| "the model".to_owned(), |file| file.display().to_string());
    judged::check(&model, &file)?;
    let poses = arguments.out.join("poses");
    inputs::make_folder(&poses)?;
    let pool = pool(arguments.threads, "eval")?;
    let model_file = arguments.model.as_deref();
    let joints = inputs::Joints::of(&arguments.joint_map, model_file)?;
    let reader = Reader {
        search: Search::new(model),
        joint_map: joints.map(None, &PARSE14),
    };
    let mut sets = Vec::new();
    for (name, people) in &all {
        let terminal = Terminal::with_bar(globals.quiet, false, judge::BAR);
        let found = pool.install(|| judged::judged(&reader, name, people, stop, &terminal));
        let set = found?;
        pictures::write_found(&poses, people, &set)?;
        sets.push(set);
    }
    write(arguments, &sets, &joints)?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses options that apply to sequences only.
fn refuse_sequence_options(arguments: &Arguments) -> Result<(), Failure> {
    let given = [
        ("--versions", !arguments.versions.is_empty()),
        ("--paper", arguments.paper.is_some()),
        ("--consistency", arguments.consistency.is_some()),
        ("--sigma", arguments.sigma.is_some()),
        ("--network", arguments.network.is_some()),
        ("--oracle", arguments.oracle),
        ("--size", arguments.size.is_some()),
        ("--scale", arguments.scale != 1.0),
        ("--every", arguments.every != 1),
        ("--frames", arguments.frames.is_some()),
        ("--share", arguments.share.is_some()),
        ("--umpm-late", arguments.umpm_late),
        ("--resume", arguments.resume),
    ];
    match given.iter().find(|option| option.1) {
        None => Ok(()),
        Some((option, _)) => {
            let message = format!("{option} has no effect on single pictures");
            Err(Failure::new(ExitKind::Usage, message))
        }
    }
}

fn write(arguments: &Arguments, sets: &[Pictures], joints: &inputs::Joints) -> Result<(), Failure> {
    let bootstrap = Bootstrap {
        block: arguments.block,
        ..Bootstrap::default()
    };
    let model = arguments.model.as_ref();
    let model = model.map_or("the shipped model".to_owned(), |model| {
        model.display().to_string()
    });
    let numbers = pictures::write_report(&arguments.out, &model, sets, &bootstrap)?;
    if arguments.json {
        return output::json(&numbers);
    }
    output::line(format_args!("joints: {joints}"))?;
    for set in sets {
        for which in Judged::ALL {
            let (name, title, report) = (&set.name, which.title(), set.report(which));
            output::line(format_args!("{name}, {title}: {report}\n"))?;
        }
    }
    let report = arguments.out.join("report.html");
    output::line(format_args!("report: {}", report.display()))
}
