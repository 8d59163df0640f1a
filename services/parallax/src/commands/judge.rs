//! `parallax model judge`: evaluates a model on annotated people.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use datasets::{ReadOptions, Selection, Sides, SkeletonTable};
use experiment::Judged;
use fmp::Search;
use launch::{inputs, output};
use offline::judged;
use runtime::Failure;
use serde_json::json;
use skeleton::PARSE14;

/// Options of `parallax model judge`.
#[derive(Debug, Args)]
#[command(after_help = "\
DATASET and SELECTION are those of `parallax train fmp`. Two detections of an image are judged: the \
best one of the image, which is how PCP is published, and the best one that covers 30 % of the box \
around the person's joints, which is how PCK is (Yang & Ramanan). Bad labels are reported and left out.

With --json one object:
    {\"images\", \"left_out\", \"best\" | \"on_person\":
     {\"missed\", \"pcp\": {\"mean_of_ends\", \"both_ends\"}, \"pck\": {\"0.1\", \"0.2\"}}}
Percentages, of every stick or joint and in \"total\".

Example:
    parallax model judge person.fmp PARSE --only 101-200")]
pub(crate) struct Arguments {
    /// The model file, of 26 parts.
    model: PathBuf,
    /// The data set: people with 14 joints.
    dataset: PathBuf,
    /// The people to evaluate, all if not given.
    #[arg(long, value_name = "SELECTION", value_parser = selection)]
    only: Option<Selection>,
    /// The people to leave out.
    #[arg(long, value_name = "SELECTION", value_parser = selection)]
    without: Option<Selection>,
    /// Meaning of left and right: `marked` as in the data set; `seen` exchanges them for people seen from behind.
    #[arg(long, value_name = "SIDES", default_value = "marked")]
    sides: Sides,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn selection(text: &str) -> Result<Selection, String> {
    Selection::from_argument(text).map_err(|it| it.to_string())
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let model = inputs::model(&arguments.model)?;
    judged::check(&model, &arguments.model.display().to_string())?;
    let options = options(arguments.only.as_ref(), arguments.without.as_ref());
    let read = datasets::read(&arguments.dataset, &options);
    let mut people = read.map_err(offline::dataset_failure)?;
    let table = SkeletonTable::published();
    let sided = people.people.into_iter();
    let sided = sided.map(|it| arguments.sides.of(it, table.joint_mirror()));
    people.people = sided.collect();
    let pictures = judged::judged(
        &Search::new(model),
        "",
        &people,
        || false,
        |text| output::message(text),
    )?;
    let [best, on_person] = Judged::ALL.map(|it| pictures.report(it));
    if arguments.json {
        output::json(&json!({
            "schema_version": 1,
            "images": best.n_images(),
            "left_out": pictures.n_left_out,
            "best": judged::numbers(&best),
            "on_person": judged::numbers(&on_person),
        }))?;
    } else {
        output::line(format_args!("{}: {best}", Judged::Best.title()))?;
        output::line(format_args!("\n{}: {on_person}", Judged::OnPerson.title()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Options for reading the people to evaluate, with 14 joints.
pub(super) fn options(only: Option<&Selection>, without: Option<&Selection>) -> ReadOptions {
    ReadOptions {
        only: only.cloned(),
        without: without.cloned(),
        n_joints: Some(PARSE14.joints.len()),
        ..ReadOptions::default()
    }
}
