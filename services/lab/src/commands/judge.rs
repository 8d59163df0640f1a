//! `parallax-lab judge`: evaluates a model on annotated people.

mod detector;
mod network;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use failure::{ExitKind, Failure, OrFail as _, Stop};
use fmp::Search;
use inputs::Joints;
use lab::evaluation::Judged;
use lab::finding;
use lab::judged::{self, Reader};
use serde_json::json;
use skeleton::PARSE14;
use statistics::score::Bootstrap;
use terminal::{Globals, Terminal, output};
use training::datasets::{People, ReadOptions, Selection, Sides, SkeletonTable};

/// Template of the progress bar.
pub(super) const BAR: &str =
    "{elapsed_precise} {bar:20} {pos}/{len} people, {per_sec}{left} {prefix}";

/// Options of `parallax-lab judge`.
#[derive(Debug, Args)]
#[command(after_help = "\
DATASET and SELECTION have the same form as in `parallax-lab train fmp`. Two detections in each image are evaluated, as published. \
PCP uses the best detection in the image. PCK uses the best detection that covers 30 % of the box \
around the person's joints (Yang & Ramanan). People with bad labels are reported and left out.

On a terminal, a bar shows the progress. Ctrl-C ends the command after the current person (exit code 130); it then prints no results.

--json prints one object:
    {\"images\", \"left_out\", \"best\" | \"on_person\":
     {\"missed\", \"pcp\": {\"mean_of_ends\", \"both_ends\"}, \"pck\": {\"0.1\", \"0.2\"}}}
The values are percentages for every stick or joint; \"total\" is over all of them.

\"joints\" describes how joints follow from the parts. --offsets adds \"offsets\": the mean offset of every joint in the best \
detection on the person, along and across its bone, with intervals, in percent of the person's height. Offsets are positive beyond the mark as \
seen from the trunk, and outwards. Only joints within 0.2 of the person's size from their marks count.

A network that finds keypoints (.onnx, docs/networks.md) sees each person in the box around the marked joints, widened \
by 5 % on each side. \"peaks\" are the joints at the maxima of its maps. In the JSON they replace \"best\" and \"on_person\". \
\"intervals\" has the 95 % intervals of the totals: {\"pcp\": {\"mean_of_ends\", \"both_ends\"}, \"pck\": {\"0.1\", \"0.2\"}}. \
\"expected_errors\" shows how well the height of the maxima predicts the errors of the joints: {\"joints\", \"off_by_half_a_head\", \
\"auc\" (for errors above half a head), \"auc_interval\", \"rank_correlation\"}.

A detector of people (.onnx) is evaluated on the held-out pictures in a file of `parallax-lab train finder-pictures`, which is DATASET. \
The output is the share of people found and the number of false boxes. A box finds a person if the two boxes share half of their union.

Examples:
    parallax-lab judge person.fmp PARSE --only 101-200
    parallax-lab judge person.boxes.onnx pictures.bin
    parallax-lab judge pose.onnx PARSE --card configs/networks/rtmpose-coco17.toml --only 101-200")]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a switch of the command line"
)]
pub(crate) struct Arguments {
    /// Model file with 26 parts, or a network that finds keypoints or people (.onnx).
    model: PathBuf,
    /// Data set of people with 14 joints. For a detector, a file made by `train finder-pictures`.
    dataset: PathBuf,
    /// The people to evaluate. If not given, all are used.
    #[arg(long, value_name = "SELECTION", value_parser = selection)]
    only: Option<Selection>,
    /// The people to leave out.
    #[arg(long, value_name = "SELECTION", value_parser = selection)]
    without: Option<Selection>,
    /// Meaning of left and right. `marked`: as in the data set. `seen`: swapped for people seen from behind.
    #[arg(long, value_name = "SIDES", default_value = "marked")]
    sides: Sides,
    /// Map from parts to joints (a file of `train joints`); "shipped" for the map of the shipped model. With "none", or for other models, a
    /// joint is the centre of its part.
    #[arg(long, value_name = "FILE", default_value = deployment::SHIPPED)]
    joint_map: PathBuf,
    /// Also print the mean offset of every joint along and across its bone, with 95 % intervals.
    #[arg(long)]
    offsets: bool,
    /// Card of a network. If not given, the .toml file of the same name beside the network, or the network's entry `parallax.card`.
    #[arg(long, value_name = "CARD")]
    card: Option<PathBuf>,
    /// Use the boxes that the shipped detector finds, instead of the boxes around the marked joints. Only for networks.
    #[arg(long)]
    find_boxes: bool,
    /// Evaluate the mirror image of every person too, and use the mean. Only for networks. This is more accurate, but takes twice as long.
    #[arg(long)]
    mirror: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Reads the people to evaluate.
    fn people(&self) -> Result<People, Failure> {
        let options = options(self.only.as_ref(), self.without.as_ref());
        let read = training::datasets::read(&self.dataset, &options);
        let mut people = read.map_err(lab::dataset_failure)?;
        let table = SkeletonTable::published();
        let sided = people.people.into_iter();
        let sided = sided.map(|sided| self.sides.of(sided, table.joint_mirror()));
        people.people = sided.collect();
        Ok(people)
    }
}

pub(super) fn selection(text: &str) -> Result<Selection, String> {
    Selection::from_argument(text).map_err(|error| error.to_string())
}

/// Runs the command.
pub(crate) fn run(arguments: &Arguments, globals: Globals) -> Result<ExitCode, Failure> {
    let stop = Stop::on_signals().or_fail(ExitKind::Run)?;
    let terminal = Terminal::with_bar(globals.quiet, false, BAR);
    let extension = arguments.model.extension();
    if extension.is_some_and(|extension| extension.eq_ignore_ascii_case("onnx")) {
        if finding::is_file::<finding::Picture>(&arguments.dataset) {
            return detector::run(arguments, &stop, &terminal);
        }
        return network::run(arguments, &stop, &terminal);
    }
    if arguments.card.is_some() || arguments.find_boxes || arguments.mirror {
        let message = format!(
            "{}: --card, --find-boxes and --mirror are only for networks (files that end in .onnx)",
            arguments.model.display()
        );
        return Err(Failure::new(ExitKind::Usage, message));
    }
    let model = inputs::model(&arguments.model)?;
    judged::check(&model, &arguments.model.display().to_string())?;
    let people = arguments.people()?;
    let joints = Joints::of(&arguments.joint_map, Some(&arguments.model))?;
    let reader = Reader {
        search: Search::new(model),
        joint_map: joints.map(None, &PARSE14),
    };
    let pictures = judged::judged(&reader, "", &people, &stop, &terminal)?;
    let [best, on_person] = Judged::ALL.map(|judged| pictures.report(judged));
    if arguments.json {
        let mut report = json!({
            "schema_version": 1,
            "joints": joints.to_string(),
            "images": best.n_images(),
            "left_out": pictures.n_left_out,
            "best": judged::numbers(&best),
            "on_person": judged::numbers(&on_person),
        });
        if arguments.offsets {
            report["offsets"] = judged::offset_numbers(&pictures.offsets(&Bootstrap::default()));
        }
        output::json(&report)?;
    } else {
        output::line(format_args!("joints: {joints}"))?;
        output::line(format_args!("{}: {best}", Judged::Best.title()))?;
        output::line(format_args!("\n{}: {on_person}", Judged::OnPerson.title()))?;
        if arguments.offsets {
            let offsets = pictures.offsets(&Bootstrap::default());
            output::line(format_args!("\n{}", judged::offset_table(&offsets)))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the options for reading the people to evaluate, with 14 joints.
pub(super) fn options(only: Option<&Selection>, without: Option<&Selection>) -> ReadOptions {
    ReadOptions {
        only: only.cloned(),
        without: without.cloned(),
        n_joints: Some(PARSE14.joints.len()),
        ..ReadOptions::default()
    }
}
