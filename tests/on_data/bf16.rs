//! Responses in bfloat16 compared with single precision: the same poses except for ties, scores within a few
//! thousandths.
//!
//! With the matrix unit where the machine has one; otherwise plain loops give the same bits.

use std::path::Path;
use std::sync::Arc;

use fmp::{Extractor, Model, Precision, Solver};
use rayon::prelude::*;
use score::{PcpRule, evaluate};
use skeleton::PARSE14;

use crate::shared_dir;
use crate::single_view::{Evidence, Picture};

type Joints = [[f64; 2]; 14];

/// The extractor in bfloat16, and whether this machine has fast instructions for it.
fn rounded(model: &Arc<Model>) -> (Extractor, bool) {
    match Extractor::in_precision(Precision::Bf16, Arc::clone(model)) {
        Ok(extractor) => (extractor, true),
        Err(error) => {
            println!("plain loops: {error}");
            (Extractor::bf16_readable(Arc::clone(model)), false)
        }
    }
}

fn read(file: &Path) -> Arc<Model> {
    Arc::new(fmp::files::read(file).unwrap())
}

fn shipped() -> Arc<Model> {
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/models/person.fmp"))
}

/// Number of parts of the best pose with the position and type of single precision, whether the level is the same,
/// and the difference of the scores.
fn compared(model: &Arc<Model>, picture: &Picture, rounded: &Extractor) -> (usize, bool, f64) {
    let solver = Solver::new(Arc::clone(model));
    let exact = Extractor::new(Arc::clone(model));
    let best = |extractor: &Extractor| {
        let evidence = Evidence::of(extractor, model, picture);
        solver.best(&evidence.view(), None).unwrap()
    };
    let (exact, rounded) = (best(&exact), best(rounded));
    let same = exact.parts.iter().zip(&rounded.parts);
    let same = same.filter(|(a, b)| a == b).count();
    let off = f64::from(rounded.score) - f64::from(exact.score);
    (same, exact.level == rounded.level, off)
}

#[test]
fn bfloat16_keeps_nearly_all_parts_on_the_reference_images() {
    let Some(shared) = shared_dir() else { return };
    let models = shared.join("data/models");
    // How many of 26 parts must be the same: two differ with the shipped model on one image.
    let models = [
        ("parse_fmp.mat", read(&models.join("parse_fmp.mat")), 26),
        (
            "humaneva_fmp.txt",
            read(&models.join("humaneva_fmp.txt")),
            26,
        ),
        ("person.fmp", shipped(), 24),
    ];
    for (name, model, least) in &models {
        let (rounded, is_fast) = rounded(model);
        // Plain loops take a minute for a large image.
        let n = if is_fast { 3 } else { 1 };
        let images = [
            "reference/test_vectors/he_c1_172x224_full.png",
            "data/humaneva/S1_Walking_1_C1_im0080.bmp",
            "data/umpm/p1_triangle_1_l_im1920.png",
        ];
        for image in &images[..n] {
            let picture = Picture::read(&shared.join(image));
            let (same, same_level, off) = compared(model, &picture, &rounded);
            println!(
                "{image}, {name}: {same} parts the same, level {same_level}, score {off:+.1e}"
            );
            assert!(
                same_level && same >= *least,
                "{image}, {name}: {same} parts"
            );
            assert!(off.abs() < 0.01, "{image}, {name}: score {off:+e}");
        }
    }
}

#[test]
fn bfloat16_is_equally_accurate_on_the_test_set() {
    let Some(shared) = shared_dir() else { return };
    let options = datasets::ReadOptions {
        only: Some(datasets::Selection::from_argument("101-200").unwrap()),
        ..datasets::ReadOptions::default()
    };
    let people = datasets::read(&shared.join("data/parse"), &options).unwrap();
    for (name, model) in [
        (
            "parse_fmp.mat",
            read(&shared.join("data/models/parse_fmp.mat")),
        ),
        ("person.fmp", shipped()),
    ] {
        let (rounded, is_fast) = rounded(&model);
        if !is_fast {
            println!("skipped: a hundred images take too long in plain loops");
            return;
        }
        let solver = Solver::new(Arc::clone(&model));
        let exact = Extractor::new(Arc::clone(&model));
        let joints = |extractor: &Extractor, picture: &Picture| {
            let evidence = Evidence::of(extractor, &model, picture);
            let pose = solver.best(&evidence.view(), None).unwrap();
            let layout = picture.layout(&model);
            Joints::try_from(PARSE14.from_parts(&pose.centres(&model, &layout))).unwrap()
        };
        let found = people.people.par_iter().map(|person| {
            let picture = Picture::read(&person.image);
            let truth = Joints::try_from(person.joints.clone()).unwrap();
            let found = [&exact, &rounded].map(|it| joints(it, &picture));
            (found, truth)
        });
        let found: Vec<_> = found.collect();
        let same = found.iter().filter(|([a, b], _)| a == b).count();
        let pcp = [0, 1].map(|which| {
            let answers = found.iter().map(|(it, truth)| (Some(&it[which]), truth));
            let report = evaluate(answers);
            [PcpRule::MeanOfEnds, PcpRule::BothEnds].map(|it| report.pcp(it).percent())
        });
        println!(
            "{name}: {same} of {} poses the same, PCP {pcp:.1?}",
            found.len()
        );
        for (exact, rounded) in pcp[0].iter().zip(pcp[1]) {
            assert!((exact - rounded).abs() <= 0.5, "{name}: PCP {pcp:?}");
        }
        assert!(same >= 90, "{name}: {same} poses the same");
    }
}
