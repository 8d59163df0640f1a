//! `parallax model judge`: a model tried on people whose joints are known.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use datasets::{Person, Picture, ReadOptions, Selection, Sides, SkeletonTable};
use evaluation::{
    PARSE_STICKS, PCK_GROUPS, PCK_SHARES, Pcp, PcpRule, Report, best_covering, evaluate,
};
use fmp::{Layout, Pose};
use rayon::prelude::*;
use runtime::{ExitKind, Failure, OrFail as _};
use serde_json::{Value, json};
use skeleton::{N_PARTS, PARSE14};

use crate::search::Search;
use crate::{inputs, output};

/// Most detections that are looked through for the one that lies on the person.
const MOST: usize = 10_000;

/// Least share of a person's box that a detection on the person covers.
const COVERED: f64 = 0.3;

/// Which model, and on whom.
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
    /// People with 14 joints.
    dataset: PathBuf,
    /// Who is judged, everybody if not given.
    #[arg(long, value_name = "SELECTION", value_parser = selection)]
    only: Option<Selection>,
    /// Who is left out.
    #[arg(long, value_name = "SELECTION", value_parser = selection)]
    without: Option<Selection>,
    /// Whose left and right: `marked`, or `seen`, for which people who are seen from behind have them
    /// exchanged.
    #[arg(long, value_name = "SIDES", default_value = "marked", value_parser = sides)]
    sides: Sides,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

fn sides(name: &str) -> Result<Sides, String> {
    Sides::by_name(name).ok_or_else(|| "expected marked or seen".to_owned())
}

fn selection(text: &str) -> Result<Selection, String> {
    Selection::from_argument(text).map_err(|it| it.to_string())
}

type Joints = [[f64; 2]; 14];

/// Tries the model.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let model = inputs::model(&arguments.model)?;
    if model.n_parts() != N_PARTS {
        let (file, n) = (arguments.model.display(), model.n_parts());
        let message = format!("{file} has {n} parts, only models of {N_PARTS} can be judged");
        return Err(Failure::new(ExitKind::Input, message));
    }
    let options = ReadOptions {
        only: arguments.only.clone(),
        without: arguments.without.clone(),
        n_joints: Some(PARSE14.joints.len()),
        ..ReadOptions::default()
    };
    let read = datasets::read(&arguments.dataset, &options);
    let mut people = read.map_err(super::train::unread)?;
    let mirror = SkeletonTable::published().joint_mirror().to_vec();
    let sided = people.people.into_iter();
    people.people = sided.map(|it| arguments.sides.of(it, &mirror)).collect();
    for problem in &people.problems {
        let (message, fault) = (problem, &problem.fault);
        output::message(format_args!("left out: {message}: {fault}"));
    }
    let judge = Judge(Search::new(model));
    let found: Result<Vec<_>, Failure> =
        people.people.par_iter().map(|it| judge.find(it)).collect();
    let found = found?;
    let report = |which: usize| {
        let truths = people.people.iter().map(truth);
        let truths: Vec<_> = truths.collect();
        let pairs = found.iter().zip(&truths);
        evaluate(pairs.map(|(found, truth)| (found[which].as_ref(), truth)))
    };
    let (best, on_person) = (report(0), report(1));
    if arguments.json {
        output::json(&json!({
            "schema_version": 1,
            "images": best.n_images(),
            "left_out": people.problems.len(),
            "best": numbers(&best),
            "on_person": numbers(&on_person),
        }))?;
    } else {
        output::line(format_args!("best detection of every image: {best}"))?;
        output::line(format_args!("\nbest detection on the person: {on_person}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The joints of a person; there are 14, or the data set would have been refused.
fn truth(person: &Person) -> Joints {
    core::array::from_fn(|it| person.joints.get(it).copied().unwrap_or([f64::NAN; 2]))
}

struct Judge(Search);

impl Judge {
    /// Joints of the best detection, and of the best one on the person.
    fn find(&self, person: &Person) -> Result<[Option<Joints>; 2], Failure> {
        let picture = Picture::read(&person.image).or_fail(ExitKind::Input)?;
        let size = picture.size();
        let Search { model, solver, .. } = &self.0;
        let Ok(layout) = Layout::new(model, size.width, size.height) else {
            return Ok([None, None]);
        };
        let threshold = model.detection_threshold() as f32;
        let (found, best) = self.0.on(picture.view(), &layout, |evidence| {
            let found = solver.above(evidence, threshold, MOST);
            (found, solver.best(evidence, None))
        });
        let boxes: Vec<_> = found.iter().map(|it| self.around(it, &layout)).collect();
        let [x, y] = [0, 1].map(|axis| {
            let values = person.joints.iter().map(|it| it[axis]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
                [low.min(it), high.max(it)]
            })
        });
        let covering = best_covering(&boxes, [x[0], y[0], x[1], y[1]], COVERED);
        let joints = |pose: &Pose| {
            let joints = PARSE14.from_parts(&pose.centres(model, &layout));
            Joints::try_from(joints).ok()
        };
        let covering = covering.and_then(|it| found.get(it));
        Ok([best.as_ref().and_then(joints), covering.and_then(joints)])
    }

    /// Score of a pose, and the box around all its parts.
    fn around(&self, pose: &Pose, layout: &Layout) -> (f64, [f64; 4]) {
        let boxes = (0..N_PARTS).map(|it| pose.part_box(&self.0.model, layout, it));
        let whole = boxes.reduce(|a, b| {
            [
                a[0].min(b[0]),
                a[1].min(b[1]),
                a[2].max(b[2]),
                a[3].max(b[3]),
            ]
        });
        (f64::from(pose.score), whole.unwrap_or([0.0; 4]))
    }
}

/// A report for programs: percentages.
fn numbers(report: &Report) -> Value {
    let sticks = |rule: PcpRule| {
        let each = PARSE_STICKS.iter().zip(report.sticks(rule));
        let mut value: serde_json::Map<String, Value> = each
            .map(|(stick, it)| (stick.0.to_owned(), it.percent().into()))
            .collect();
        value.insert("total".to_owned(), report.pcp(rule).percent().into());
        value
    };
    let joints = |share: usize| {
        let each = PCK_GROUPS.iter().zip(report.groups(share));
        let mut value: serde_json::Map<String, Value> = each
            .map(|((name, _), it): (_, Pcp)| ((*name).to_owned(), it.percent().into()))
            .collect();
        value.insert("total".to_owned(), report.pck(share).percent().into());
        value
    };
    let pck: serde_json::Map<String, Value> = PCK_SHARES
        .iter()
        .enumerate()
        .map(|(share, it)| (it.to_string(), joints(share).into()))
        .collect();
    json!({
        "missed": report.n_missed(),
        "pcp": {
            "mean_of_ends": sticks(PcpRule::MeanOfEnds),
            "both_ends": sticks(PcpRule::BothEnds),
        },
        "pck": pck,
    })
}
