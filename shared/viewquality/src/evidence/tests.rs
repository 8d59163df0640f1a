//! Tests that every value of the evidence corresponds to its name.

use fmp::{Edge, Filter, ModelSpec, N_CHANNELS, PartSpec, Placement, Spring};

use super::*;
use crate::TileShape;

/// A root and two child parts that mirror each other.
fn model(n_types: usize) -> Model {
    let filter = Filter {
        rows: 3,
        cols: 3,
        weights: vec![0.0; 9 * N_CHANNELS],
    };
    let spring = Spring {
        w: [0.01, 0.1, 0.02, 0.2],
        anchor: [1, 2],
    };
    let part = |part: usize| PartSpec {
        name: format!("part {part}"),
        filter_of_type: (0..n_types).map(|i| part * n_types + i).collect(),
        edge: (part > 0).then(|| Edge {
            parent: 0,
            bias: (0..n_types)
                .map(|l| (0..n_types).map(|k| (10 * l + k) as f64).collect())
                .collect(),
            springs: Springs::PerChildType(vec![spring; n_types]),
        }),
    };
    Model::new(ModelSpec {
        name: "three".to_owned(),
        parts: vec![part(0), part(1), part(2)],
        filters: vec![filter; 3 * n_types],
        root_bias: 0.0,
        interval: 5,
        cell_px: 4,
        threshold: -1.0,
        mirror: Some(vec![0, 2, 1]),
    })
    .unwrap()
}

fn pose(score: f32, second: [u16; 2]) -> Pose {
    let place = |x, y, mixture| Placement { x, y, mixture };
    Pose {
        score,
        level: 0,
        parts: vec![
            place(5, 4, 1),
            place(second[0], second[1], 0),
            place(5, 4, 0),
        ],
    }
}

const SCORES: [LocalScore; 3] = [
    LocalScore {
        response: 1.0,
        contrast: 2.0,
        margin: 3.0,
    },
    LocalScore {
        response: 0.5,
        contrast: -1.0,
        margin: 0.25,
    },
    LocalScore {
        response: 4.0,
        contrast: 0.0,
        margin: 0.0,
    },
];

fn numbers(candidates: &[Pose]) -> impl Fn(&str) -> f32 + use<> {
    let model = model(2);
    let layout = Layout::new(&model, 80, 60).unwrap();
    let bounds = candidates[0].bounding_box(&model, &layout);
    let tile = Tile::around(bounds, TileShape::SMALL).unwrap();
    let mut out = vec![f32::NAN; 3];
    evidence((&model, &layout), candidates, &SCORES, &tile, &mut out).unwrap();
    assert_eq!(out.len(), n_evidence(3));
    move |name| {
        let index = (0..out.len()).find(|i| evidence_name(*i, 3).as_deref() == Some(name));
        out[index.unwrap_or_else(|| panic!("no number is called {name}"))]
    }
}

#[test]
fn a_model_with_26_parts_has_424_values_with_distinct_names() {
    assert_eq!(n_evidence(26), 424);
    let names: std::collections::BTreeSet<String> =
        (0..424).map(|i| evidence_name(i, 26).unwrap()).collect();
    assert_eq!(names.len(), 424);
    assert_eq!(evidence_name(424, 26), None);
    assert_eq!(evidence_name(16 + 3, 26).unwrap(), "part 2 spring");
}

#[test]
fn spring_and_bias_scores_equal_those_of_the_model() {
    let at = numbers(&[pose(2.0, [8, 9])]);
    // Displacement: parent (5, 4) + anchor (1, 2) - child (8, 9) = (-2, -3).
    let expected = -(0.01 * 4.0 - 0.1 * 2.0 + 0.02 * 9.0 - 0.2 * 3.0);
    assert!((at("part 2 spring") - expected).abs() < 1e-6);
    // The displacement of the other child equals its anchor, (1, 2).
    let other = -(0.01 + 0.1 + 0.02 * 4.0 + 0.2 * 2.0);
    assert!((at("springs") - at("part 2 spring") - other).abs() < 1e-6);
    assert_eq!(at("part 1 spring"), 0.0);
    // The bias of type 1 of the child with type 2 of the parent.
    assert_eq!(at("part 2 pair_bias"), 10.0);
    assert_eq!(at("part 1 pair_bias"), 0.0);
}

#[test]
fn types_and_scores_equal_those_of_the_pose() {
    let at = numbers(&[pose(2.0, [8, 9])]);
    assert_eq!((at("part 1 type_1"), at("part 1 type_2")), (0.0, 1.0));
    assert_eq!((at("part 2 type_1"), at("part 2 type_6")), (1.0, 0.0));
    let local = ["response", "contrast", "margin"].map(|name| at(&format!("part 2 {name}")));
    assert_eq!(local, [0.5, -1.0, 0.25]);
    assert_eq!((at("score"), at("responses")), (2.0, 5.5));
    // A part's box is three cells of four pixels wide.
    assert!((at("log_box_side") - 12.0_f32.ln()).abs() < 1e-6);
}

#[test]
fn distances_are_measured_in_box_sides() {
    // The mirrored part is 3 columns and 4 rows away: 5 cells of 4 pixels. A box has 3 cells.
    let at = numbers(&[pose(2.0, [8, 8])]);
    assert!((at("part 3 from_mirror") - 5.0 / 3.0).abs() < 1e-6);
    assert_eq!(at("part 3 from_mirror"), at("part 2 from_mirror"));
    assert_eq!(at("part 1 from_mirror"), 0.0, "its own mirror");
    assert_eq!((at("part 2 from_second"), at("lead")), (FAR, FAR));
    let at = numbers(&[pose(2.0, [8, 8]), pose(1.5, [8, 5])]);
    assert!((at("part 2 from_second") - 1.0).abs() < 1e-6);
    assert_eq!((at("part 1 from_second"), at("lead")), (0.0, 0.5));
    assert_eq!(at("candidates"), 0.25);
}

#[test]
fn the_distance_inside_the_frame_is_negative_for_a_part_outside() {
    // The padding is one cell. Column 0 begins at -4 pixels, and the centre of its box is at 1.5.
    let at = numbers(&[pose(2.0, [0, 8])]);
    assert!((at("part 2 inside") - 1.5 / 12.0).abs() < 1e-6);
    let at = numbers(&[pose(2.0, [20, 8])]);
    assert!(at("part 2 inside") < 0.0);
}

#[test]
fn rejects_poses_that_do_not_fit() {
    let [few, many] = [model(2), model(7)];
    let layout = Layout::new(&few, 80, 60).unwrap();
    let tile = Tile::around([0.0, 0.0, 9.0, 9.0], TileShape::SMALL).unwrap();
    let candidates = [pose(2.0, [8, 9])];
    let said = |model: &Model, candidates: &[Pose], scores: &[LocalScore]| {
        let refused = evidence((model, &layout), candidates, scores, &tile, &mut Vec::new());
        refused.unwrap_err().to_string()
    };
    assert_eq!(said(&few, &[], &SCORES), "there is no pose");
    assert_eq!(
        said(&few, &candidates, &SCORES[..1]),
        "there are 1 local scores for 3 parts"
    );
    assert_eq!(
        said(&many, &candidates, &SCORES),
        "part 1 has 7 types, but the evidence allows at most 6"
    );
}
