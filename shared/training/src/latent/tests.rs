//! Compares poses near a marked person with an exhaustive search.

use std::sync::Arc;

use fmp::{Extractor, FeaturePyramid, Layout, Model, Placement, Pose, Responses, Solver};

use super::{Marked, best_near, nearest};
use crate::confuse::{Confuser, loss};
use crate::example::{Cells, Example};
use crate::testing::{noise, shape, vector};

const OVERLAP: f64 = 0.5;

fn marked(types: Option<Vec<usize>>) -> Marked {
    Marked {
        parts: vec![[33.0, 20.0], [35.0, 33.0], [30.0, 46.0]],
        side: 14.0,
        types,
    }
}

/// The score of a pose, from its feature vector.
fn score(v: &[f64], pyramid: &FeaturePyramid<'_>, pose: &Pose) -> f64 {
    let (shape, v) = (
        shape(),
        v.iter().map(|value| *value as f32).collect::<Vec<_>>(),
    );
    let map = pyramid.level(usize::from(pose.level));
    let example = Example::of(&shape, &shape.coordinates(), &map, pose);
    example.features.dot(&v) + example.fixed
}

/// Intersection over union of a part's box and the marked box.
fn overlap(model: &Model, layout: &Layout, pose: &Pose, part: usize) -> f64 {
    let it = pose.part_box(model, layout, part);
    let (marked, half) = (marked(None), 6.5);
    let [x, y] = marked.parts[part];
    let other = [x - half, y - half, x + half, y + half];
    let area = |bounds: [f64; 4]| {
        (bounds[2] - bounds[0] + 1.0).max(0.0) * (bounds[3] - bounds[1] + 1.0).max(0.0)
    };
    let corner = |k: usize| {
        if k < 2 {
            it[k].max(other[k])
        } else {
            it[k].min(other[k])
        }
    };
    let common = area([0, 1, 2, 3].map(corner));
    common / (area(it) + area(other) - common)
}

/// All positions at which a part overlaps its marked box and has its required type.
fn placements(
    model: &Model,
    layout: &Layout,
    level: u16,
    part: usize,
    types: Option<&Vec<usize>>,
) -> Vec<Placement> {
    let it = &layout.levels[usize::from(level)];
    let mut found = Vec::new();
    for cell in 0..it.rows * it.cols {
        for mixture in 0..model.n_types(part) {
            let mut parts = vec![Placement::default(); 3];
            parts[part] = Placement {
                x: (cell % it.cols) as u16,
                y: (cell / it.cols) as u16,
                mixture: mixture as u8,
            };
            let placed = parts[part];
            let score = 0.0;
            let pose = Pose {
                score,
                level,
                parts,
            };
            let has_type = types.is_none_or(|kind| kind[part] == mixture);
            if has_type && overlap(model, layout, &pose, part) >= OVERLAP {
                found.push(placed);
            }
        }
    }
    found
}

#[test]
fn the_best_pose_near_the_marks_is_found() {
    let v = vector(7);
    let model = shape().model(&v, 0.0).unwrap();
    let picture = noise(71, 80, 5);
    let layout = Layout::new(&model, 71, 80).unwrap();
    let pyramid = FeaturePyramid::new(&model, picture.view(), &layout);
    for types in [None, Some(vec![0, 1, 0])] {
        let marked = marked(types.clone());
        let found = best_near(&model, &pyramid, &layout, &marked, OVERLAP).unwrap();
        let mut best = f64::NEG_INFINITY;
        for level in 0..layout.levels.len() as u16 {
            let of = |part| placements(&model, &layout, level, part, types.as_ref());
            let (heads, trunks, legs) = (of(0), of(1), of(2));
            for (head, trunk) in heads.iter().flat_map(|h| trunks.iter().map(move |t| (h, t))) {
                for leg in &legs {
                    let parts = vec![*head, *trunk, *leg];
                    let pose = Pose {
                        score: 0.0,
                        level,
                        parts,
                    };
                    best = best.max(score(&v, &pyramid, &pose));
                }
            }
        }
        let found = f64::from(found.score);
        assert!((found - best).abs() < 1e-4, "{found} {best} {types:?}");
    }
}

#[test]
fn the_product_of_example_and_weights_is_the_score_of_the_pose() {
    let (shape, v) = (shape(), vector(11));
    let model = Arc::new(shape.model(&v, 0.0).unwrap());
    let picture = noise(64, 72, 3);
    let layout = Layout::new(&model, 64, 72).unwrap();
    let pyramid = FeaturePyramid::new(&model, picture.view(), &layout);
    let mut values = vec![0.0; layout.n_responses()];
    Extractor::new(Arc::clone(&model)).responses(picture.view(), &layout, &mut values);
    let levels: Vec<_> = (0..layout.levels.len() as u16).collect();
    let evidence = Responses::new(&layout, &values, &levels);
    let poses = Solver::new(Arc::clone(&model)).above(&evidence, -1e9, 60);
    assert_eq!(poses.len(), 60);
    let all = Cells::of(&pyramid, layout.levels.len());
    let single: Vec<f32> = v.iter().map(|value| *value as f32).collect();
    for pose in poses {
        let own = score(&v, &pyramid, &pose);
        assert!(
            (own - f64::from(pose.score)).abs() < 2e-4,
            "{own} {}",
            pose.score
        );
        let shared = Example::sharing(&shape, &shape.coordinates(), &all, &pose);
        let shared = shared.features.dot(&single) + shared.fixed;
        assert!((own - shared).abs() < 1e-5, "{own} {shared}");
    }
}

#[test]
fn people_without_a_fitting_level_are_not_placed() {
    let model = shape().model(&vector(1), 0.0).unwrap();
    let picture = noise(71, 80, 5);
    let layout = Layout::new(&model, 71, 80).unwrap();
    let pyramid = FeaturePyramid::new(&model, picture.view(), &layout);
    let mut small = marked(None);
    small.side = 5.0;
    assert_eq!(best_near(&model, &pyramid, &layout, &small, OVERLAP), None);
    let mut outside = marked(None);
    outside.parts[2] = [200.0, 46.0];
    assert_eq!(
        best_near(&model, &pyramid, &layout, &outside, OVERLAP),
        None
    );
    assert_eq!(nearest(&model, &layout, &outside, OVERLAP), None);
}

#[test]
fn the_nearest_pose_lies_within_half_a_cell_and_has_the_types() {
    let model = shape().model(&vector(1), 0.0).unwrap();
    let layout = Layout::new(&model, 71, 80).unwrap();
    let marked = marked(Some(vec![0, 1, 1]));
    let pose = nearest(&model, &layout, &marked, OVERLAP).unwrap();
    let types: Vec<_> = pose.parts.iter().map(|part| part.mixture).collect();
    assert_eq!(types, [0, 1, 1]);
    let scale = layout.levels[usize::from(pose.level)].scale;
    for (centre, mark) in pose.centres(&model, &layout).iter().zip(&marked.parts) {
        let off = (centre[0] - mark[0]).abs().max((centre[1] - mark[1]).abs());
        assert!(off <= 0.5 * scale + 1e-9, "{off} of cells of {scale}");
    }
}

#[test]
fn the_worst_wrong_pose_maximises_score_plus_loss() {
    let v = vector(23);
    let model = shape().model(&v, 0.0).unwrap();
    let (picture, marked) = (noise(71, 80, 9), marked(None));
    let layout = Layout::new(&model, 71, 80).unwrap();
    let pyramid = FeaturePyramid::new(&model, picture.view(), &layout);
    let right = best_near(&model, &pyramid, &layout, &marked, OVERLAP).unwrap();
    let wrong = Confuser::new(model.clone()).worst(&picture, &marked, 3.0).unwrap();
    let lost = |pose: &Pose| loss(&model, &layout, &marked, 3.0).of_pose(&model, pose);
    let with_loss = |pose: &Pose| score(&v, &pyramid, pose) + lost(pose);
    assert!(lost(&right) < 0.75, "{}", lost(&right));
    assert!(with_loss(&wrong) >= with_loss(&right) - 1e-4);
    let off = f64::from(wrong.score) - with_loss(&wrong);
    assert!(
        off.abs() < 1e-3,
        "the loss that was added is the loss: {off}"
    );
}
