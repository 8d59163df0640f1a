//! A model on pictures of people whose joints are known.

use datasets::{People, Person, Picture};
use evaluation::{PARSE_STICKS, PCK_GROUPS, PCK_SHARES, Pcp, PcpRule, Report, best_covering};
use experiment::{Joints, Pictures};
use fmp::{Layout, Pose, Search};
use rayon::prelude::*;
use runtime::{ExitKind, Failure, OrFail as _};
use serde_json::{Value, json};
use skeleton::{N_PARTS, PARSE14};

/// Most detections that are looked through for the one that lies on the person.
const MOST: usize = 10_000;

/// Least share of a person's box that a detection on the person covers.
const COVERED: f64 = 0.3;

/// Tries a model on people, on rayon's current pool.
///
/// * `name`: of the data set.
/// * `is_over`: whether to give up.
/// * `message`: is given a message about everybody who was left out.
///
/// # Errors
///
/// An image cannot be read; it was given up ([`ExitKind::Interrupted`]).
pub fn judged(
    search: &Search,
    name: &str,
    people: &People,
    is_over: impl Fn() -> bool + Sync,
    message: impl Fn(&str),
) -> Result<Pictures, Failure> {
    for problem in &people.problems {
        message(&format!("left out: {problem}: {}", problem.fault));
    }
    let find = |person: &Person| {
        if is_over() {
            return Err(Failure::new(ExitKind::Interrupted, "interrupted"));
        }
        find(search, person)
    };
    let found: Result<Vec<_>, Failure> = people.people.par_iter().map(find).collect();
    Ok(Pictures {
        name: name.to_owned(),
        n_left_out: people.problems.len(),
        truths: people.people.iter().map(truth).collect(),
        found: found?,
    })
}

/// Refuses a model of other parts.
///
/// # Errors
///
/// The model has not 26 parts.
pub fn check(model: &fmp::Model, name: &str) -> Result<(), Failure> {
    let n = model.n_parts();
    if n == N_PARTS {
        return Ok(());
    }
    let message = format!("{name} has {n} parts, only models of {N_PARTS} can be judged");
    Err(Failure::new(ExitKind::Input, message))
}

/// The joints of a person; there are 14, or the data set would have been refused.
fn truth(person: &Person) -> Joints {
    core::array::from_fn(|it| person.joints.get(it).copied().unwrap_or([f64::NAN; 2]))
}

/// Joints of the best detection, and of the best one on the person.
fn find(search: &Search, person: &Person) -> Result<[Option<Joints>; 2], Failure> {
    let picture = Picture::read(&person.image).or_fail(ExitKind::Input)?;
    let size = picture.size();
    let Search { model, solver, .. } = search;
    let Ok(layout) = Layout::new(model, size.width, size.height) else {
        return Ok([None, None]);
    };
    let threshold = model.detection_threshold() as f32;
    let (found, best) = search.on(picture.view(), &layout, |evidence| {
        let found = solver.above(evidence, threshold, MOST);
        (found, solver.best(evidence, None))
    });
    let boxes: Vec<_> = found.iter().map(|it| around(model, it, &layout)).collect();
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
fn around(model: &fmp::Model, pose: &Pose, layout: &Layout) -> (f64, [f64; 4]) {
    let boxes = (0..N_PARTS).map(|it| pose.part_box(model, layout, it));
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

/// A report for programs: percentages.
pub fn numbers(report: &Report) -> Value {
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
