//! Evaluation of a model on pictures of people with known joints.

use std::fmt::Write as _;
use std::sync::Arc;

use crate::evaluation::{Joints, Pictures};
use failure::{Console, ExitKind, Failure, OrFail as _, Stop};
use fmp::{Layout, Pose, Search};
use rayon::prelude::*;
use serde_json::{Value, json};
use skeleton::{JointMap, N_PARTS, PARSE14};
use statistics::score::{
    Offset, PARSE_STICKS, PCK_GROUPS, PCK_SHARES, Pcp, PcpRule, Report, best_covering,
};
use training::datasets::{People, Person, Picture};

/// Largest number of detections that are searched for one that covers the person.
const MOST: usize = 10_000;

/// Smallest fraction of a person's box that a detection must cover to count as a detection of that person.
const COVERED: f64 = 0.3;

/// A model and its map from parts to joints.
#[derive(Debug)]
pub struct Reader {
    /// Searches with the model.
    pub search: Search,
    /// Map from parts to the joints of `skeleton::PARSE14`; without it, each joint is the centre of one part.
    pub joint_map: Option<Arc<JointMap>>,
}

impl Reader {
    fn joints(&self, centres: &[[f64; 2]]) -> Option<Joints> {
        let joints = match &self.joint_map {
            Some(map) => map.from_parts(centres),
            None => PARSE14.from_parts(centres),
        };
        Joints::try_from(joints).ok()
    }
}

/// Evaluates a model on people, on rayon's current pool.
///
/// * `name`: name of the data set.
/// * `stop`: checked before every person.
/// * `console`: shows every person who was left out, and the progress.
///
/// # Errors
///
/// Fails if an image cannot be read, or on a stop request ([`ExitKind::Interrupted`]).
pub fn judged(
    reader: &Reader,
    name: &str,
    people: &People,
    stop: &Stop,
    console: &dyn Console,
) -> Result<Pictures, Failure> {
    let find = |person: &Person| {
        stop.check("interrupted")?;
        let found = find(&reader.search, person)?;
        console.advance(1);
        Ok(found.map(|detection| detection.and_then(|candidate| reader.joints(&candidate))))
    };
    pictures(name, people, console, |people| {
        people.par_iter().map(find).collect()
    })
}

/// Returns the joints found on people, with the ground truth.
///
/// * `find`: returns the detections of every person, and advances the progress bar of the console.
pub(crate) fn pictures(
    name: &str,
    people: &People,
    console: &dyn Console,
    find: impl FnOnce(&[Person]) -> Result<Vec<[Option<Joints>; 2]>, Failure>,
) -> Result<Pictures, Failure> {
    for problem in &people.problems {
        console.message(&format!("left out: {problem}: {}", problem.fault));
    }
    console.set(0, people.people.len());
    console.begin(name, "");
    let found = find(&people.people);
    console.finish();
    Ok(Pictures {
        name: name.to_owned(),
        n_left_out: people.problems.len(),
        truths: people.people.iter().map(truth).collect(),
        found: found?,
    })
}

/// Refuses a model that does not have 26 parts.
///
/// # Errors
///
/// Fails if the model does not have 26 parts.
pub fn check(model: &fmp::Model, name: &str) -> Result<(), Failure> {
    let n = model.n_parts();
    if n == N_PARTS {
        return Ok(());
    }
    let message = format!("{name} has {n} parts, but only models with {N_PARTS} can be evaluated");
    Err(Failure::new(ExitKind::Input, message))
}

/// Returns the true joints of a person. There are always 14, because data sets with another number are refused.
pub(crate) fn truth(person: &Person) -> Joints {
    core::array::from_fn(|i| person.joints.get(i).copied().unwrap_or([f64::NAN; 2]))
}

/// Centres of the parts of a detection, in pixels.
pub(crate) type Centres = Vec<[f64; 2]>;

/// Returns the best detection in the picture, and the best detection that covers the person.
pub(crate) fn find(search: &Search, person: &Person) -> Result<[Option<Centres>; 2], Failure> {
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
    let boxes: Vec<_> = found.iter().map(|candidate| around(model, candidate, &layout)).collect();
    let [x, y] = [0, 1].map(|axis| {
        let values = person.joints.iter().map(|joint| joint[axis]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| {
            [low.min(it), high.max(it)]
        })
    });
    let covering = best_covering(&boxes, [x[0], y[0], x[1], y[1]], COVERED);
    let centres = |pose: &Pose| pose.centres(model, &layout);
    let covering = covering.and_then(|covering| found.get(covering));
    Ok([best.as_ref().map(centres), covering.map(centres)])
}

/// Returns the score of a pose, and the box around all its parts.
fn around(model: &fmp::Model, pose: &Pose, layout: &Layout) -> (f64, [f64; 4]) {
    let boxes = (0..N_PARTS).map(|i| pose.part_box(model, layout, i));
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

/// Returns a report as JSON, in percent.
pub fn numbers(report: &Report) -> Value {
    let sticks = |rule: PcpRule| {
        let each = PARSE_STICKS.iter().zip(report.sticks(rule));
        let mut value: serde_json::Map<String, Value> =
            each.map(|(stick, it)| (stick.0.to_owned(), it.percent().into())).collect();
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

/// Returns the mean offsets of joints as JSON.
pub fn offset_numbers(offsets: &[Offset]) -> Value {
    let each = offsets.iter().map(|offset| {
        json!({
            "joint": offset.joint,
            "found": offset.n_found,
            "of": offset.n,
            "along": offset.mean[0],
            "along_interval": offset.interval[0],
            "across": offset.mean[1],
            "across_interval": offset.interval[1],
        })
    });
    each.collect()
}

/// Returns the mean offsets of joints as a table.
pub fn offset_table(offsets: &[Offset]) -> String {
    let mut text =
        "mean offset, % of the height     found    along the bone          across the bone"
            .to_owned();
    for it in offsets {
        let number = |axis: usize| {
            let [low, high] = it.interval[axis];
            format!("{:6.2} ({low:5.2} to {high:5.2})", it.mean[axis])
        };
        // Writing to a string cannot fail.
        let _infallible = write!(
            text,
            "\n{:<24} {:>5} of {:>5}  {}  {}",
            it.joint,
            it.n_found,
            it.n,
            number(0),
            number(1)
        );
    }
    text
}
