//! An evaluation with invented numbers, for tests of reports in this crate and, with the feature `testing`, in other crates.

use statistics::score::Bootstrap;

use crate::evaluation::{Combining, FrameScore, Measured, Summary, Terms, Version, summarise};

/// Returns the results of three versions, each better than the previous version, on two boxing subjects of `HumanEva` with five frames
/// each.
pub(crate) fn made_up() -> (Summary, Vec<Version>) {
    let geometry = |combining| Version {
        terms: Terms::Geometry,
        combining,
    };
    let versions = vec![
        Version::SINGLE,
        geometry(Combining::Pairs),
        geometry(Combining::AllViews),
    ];
    let score = |error: f64| FrameScore {
        segments: vec![Some(error); 12],
        joints_m: vec![Some(0.1 * error); 14],
        views: vec![Some((Some([[10.0 * error, 0.0]; 14]), [[0.0; 2]; 14]))],
        iterations: vec![4],
        ..FrameScore::default()
    };
    let measured = |subject: &str| Measured {
        dataset: "HumanEva".to_owned(),
        subject: subject.to_owned(),
        action: "Box".to_owned(),
        scores: vec![[0.7, 0.45, 0.3].map(score).to_vec(); 5],
    };
    let names: Vec<String> = versions.iter().map(ToString::to_string).collect();
    let summary = summarise(
        &[measured("S1"), measured("S2")],
        &names,
        &Bootstrap::default(),
    );
    (summary, versions)
}
