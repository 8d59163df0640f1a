//! A hundred images of the PARSE test set against Yang & Ramanan's own detections.
//!
//! With another JPEG decoder (`image` 0.25) the PCP is 69.8 and 22 detections are the same.

use std::sync::Arc;

use fmp::{Extractor, Model, Solver};
use rayon::prelude::*;
use serde_json::Value;
use skeleton::PARSE14;

use crate::shared_dir;
use crate::single_view::{Evidence, Picture, json};

/// One image: sticks found, by each of the two programs, and whether the detection is the same.
struct Outcome {
    ours: [bool; 10],
    theirs: [bool; 10],
    score_off: f64,
    same_level: bool,
    same_parts: usize,
}

#[test]
fn pcp_on_images_101_to_200_is_that_of_the_original_program() {
    let Some(shared) = shared_dir() else { return };
    let model = Arc::new(fmp::files::read(&shared.join("data/models/parse_fmp.mat")).unwrap());
    let extractor = Extractor::new(Arc::clone(&model));
    let solver = Solver::new(Arc::clone(&model));
    let outcomes: Vec<_> = (101..=200)
        .into_par_iter()
        .map(|number| {
            let picture =
                Picture::read_as_libjpeg(&shared.join(format!("data/parse/im{number:04}.jpg")));
            let theirs = json(&shared.join(format!("reference/parse/im{number:04}.json")));
            let evidence = Evidence::of(&extractor, &model, &picture);
            outcome(&model, &solver, &evidence, &theirs)
        })
        .collect();
    let pcp = |sticks: fn(&Outcome) -> &[bool; 10]| {
        let found = outcomes.iter().flat_map(sticks).filter(|it| **it).count();
        found as f64 / 10.0
    };
    let (ours, theirs) = (pcp(|it| &it.ours), pcp(|it| &it.theirs));
    let describe = |(number, it): (usize, &Outcome)| {
        let same = it.same_level && it.same_parts == 26;
        let level = if it.same_level { "same" } else { "other" };
        let (parts, off) = (it.same_parts, it.score_off);
        (!same).then(|| format!("im{number:04}: {parts} parts, {level} level, score {off:+.1e}"))
    };
    let differing: Vec<_> = (101..).zip(&outcomes).filter_map(describe).collect();
    assert!(
        (theirs - 71.3).abs() < 0.05,
        "sticks as the reference counts them: {theirs}"
    );
    assert!((ours - 71.3).abs() <= 0.3, "PCP {ours}");
    assert!(differing.len() <= 3, "{differing:#?}");
}

fn outcome(model: &Model, solver: &Solver, evidence: &Evidence, theirs: &Value) -> Outcome {
    let evidence = evidence.view();
    let pose = solver.best(&evidence, None).unwrap();
    let best = &theirs["detections"][0];
    let number = |it: &Value| it.as_f64().unwrap();
    let centre = |it: &Value| {
        [["x1", "x2"], ["y1", "y2"]]
            .map(|[a, b]| f64::midpoint(number(&it[a]), number(&it[b])) - 1.0)
    };
    let their_parts: Vec<_> = best["parts"]
        .as_array()
        .unwrap()
        .iter()
        .map(centre)
        .collect();
    let our_parts = pose.centres(model, evidence.layout());
    let near = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).hypot(a[1] - b[1]) < 0.1;
    let truth: Vec<_> = theirs["gt_joints_14"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| [number(&it[0]) - 1.0, number(&it[1]) - 1.0])
        .collect();
    Outcome {
        ours: sticks_found(&PARSE14.from_parts(&our_parts), &truth),
        theirs: sticks_found(&PARSE14.from_parts(&their_parts), &truth),
        score_off: f64::from(pose.score) - number(&best["score"]),
        same_level: best["level"].as_u64() == Some(u64::from(pose.level) + 1),
        same_parts: our_parts
            .iter()
            .zip(&their_parts)
            .filter(|it| near(*it))
            .count(),
    }
}

/// Whether the mean distance of a stick's ends from the true ones is at most half its true length.
fn sticks_found(joints: &[[f64; 2]], truth: &[[f64; 2]]) -> [bool; 10] {
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let (ours, true_ones) = (sticks(joints), sticks(truth));
    std::array::from_fn(|it| {
        let ([a, b], [c, d]) = (ours[it], true_ones[it]);
        f64::midpoint(distance(a, c), distance(b, d)) <= 0.5 * distance(c, d)
    })
}

/// Torso, upper and lower legs, upper and lower arms, head, as pairs of ends.
fn sticks(j: &[[f64; 2]]) -> [[[f64; 2]; 2]; 10] {
    let middle = |a: [f64; 2], b: [f64; 2]| [f64::midpoint(a[0], b[0]), f64::midpoint(a[1], b[1])];
    [
        [middle(j[8], j[9]), middle(j[2], j[3])],
        [j[2], j[1]],
        [j[3], j[4]],
        [j[1], j[0]],
        [j[4], j[5]],
        [j[8], j[7]],
        [j[9], j[10]],
        [j[7], j[6]],
        [j[10], j[11]],
        [j[12], j[13]],
    ]
}
