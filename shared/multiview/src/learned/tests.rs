//! Properties of the learned parameters and their file.

use std::f64::consts::PI;

use proptest::prelude::*;
use skeleton::{MIRROR, N_PARTS, PARSE14};

use crate::learned::*;

fn shape() -> Shape {
    Shape {
        n_types: vec![3; N_PARTS],
        mirror: MIRROR.to_vec(),
    }
}

/// Returns a person whose parts have type `types(part)` and an error of `error` tenths.
fn observation(types: impl Fn(usize) -> u8, error: f32, exchanged: bool) -> ViewObservation {
    ViewObservation {
        types: (0..N_PARTS).map(types).collect(),
        centres: (0..N_PARTS).map(|i| [i as f64, 10.0 * i as f64]).collect(),
        errors: vec![error; N_PARTS],
        exchanged,
        size: 100.0,
        joints: vec![Some([5.0, 5.0]); PARSE14.joints.len()],
    }
}

fn learner() -> Learner {
    Learner::new(shape(), Settings::default())
}

fn learned(learner: &Learner) -> Learned {
    let weights = Weights::default();
    let rig = Some("hall");
    learner.learned("0".repeat(16), weights, rig, Some(0.01)).unwrap()
}

/// Adds a pair of views with a given angle between them, `n` times.
fn add_views(learner: &mut Learner, views: [&ViewObservation; 2], degrees: f64, n: usize) {
    for _ in 0..n {
        learner.add_view(views[0], &PARSE14);
        learner.add_view(views[1], &PARSE14);
        learner.add_pair(&Pair {
            views,
            angle: Some(degrees.to_radians()),
            cameras: Some(["left", "right"]),
        });
        learner.end_instant();
    }
}

/// Returns the paper's table of the pair at an angle: part, types in the first and the second view.
fn at(of: &Learned, degrees: f64, part: usize, types: [usize; 2]) -> f64 {
    let tables = of.by_angle(Appearance::Joint);
    let tables = tables.at(degrees.to_radians()).unwrap();
    tables.joint.value(part, types[0], types[1])
}

#[test]
fn types_seen_together_are_likely_at_their_angle_in_both_directions() {
    let mut learner = learner();
    let (first, second) = (
        observation(|_| 0, 0.1, false),
        observation(|_| 2, 0.1, false),
    );
    add_views(&mut learner, [&first, &second], 50.0, 100);
    let learned = learned(&learner);
    assert!(at(&learned, 50.0, 4, [0, 2]) > 0.8);
    assert!(at(&learned, -50.0, 4, [2, 0]) > 0.8);
    assert!(at(&learned, 50.0, 4, [2, 0]) < 0.1);
}

#[test]
fn the_order_of_two_views_does_not_matter() {
    let views = [
        observation(|part| (part % 3) as u8, 0.1, false),
        observation(|part| (part % 2) as u8, 0.1, true),
    ];
    let [mut one, mut other] = [learner(), learner()];
    add_views(&mut one, [&views[0], &views[1]], 70.0, 30);
    add_views(&mut other, [&views[1], &views[0]], -70.0, 30);
    assert_eq!(learned(&one).ring, learned(&other).ring);
}

#[test]
fn views_from_behind_have_separate_tables() {
    let mut learner = learner();
    // The right arm has type 1 and the left arm type 2; sides are named as in each picture.
    let side = |value: usize| if value < 14 { 1 } else { 2 };
    let (front, back) = (observation(side, 0.1, false), observation(side, 0.1, true));
    add_views(&mut learner, [&front, &back], 175.0, 100);
    let learned = learned(&learner);
    let joint = learned.by_angle(Appearance::Joint);
    let joint = joint.at(PI * 0.98).unwrap();
    // Part 5 of the front view is part 17 of the back view.
    assert!(joint.exchanged.as_ref().unwrap().value(5, 1, 2) > 0.8);
    let lift = learned.by_angle(Appearance::Lift);
    let same = &lift.at(PI * 0.98).unwrap().joint;
    assert!(same.value(5, 1, 1).abs() < 1e-9, "it was not observed");
}

#[test]
fn views_far_from_the_truth_count_for_tau_but_not_for_types() {
    let mut learner = learner();
    let (good, bad) = (
        observation(|_| 0, 0.1, false),
        observation(|_| 1, 3.0, false),
    );
    add_views(&mut learner, [&good, &good], 50.0, 2);
    add_views(&mut learner, [&bad, &good], 50.0, 3);
    let learned = learned(&learner);
    assert_eq!(learned.rigs[0].pairs[0].counts.total(), 2 * N_PARTS as u64);
    // There are 7 good views and 3 bad ones.
    assert_eq!(learned.tau_tenths, vec![0.1; N_PARTS]);
}

#[test]
fn without_views_near_the_truth_nothing_is_learned() {
    let mut learner = learner();
    let bad = observation(|_| 1, 3.0, false);
    add_views(&mut learner, [&bad, &bad], 50.0, 3);
    let error = learner.learned(String::new(), Weights::default(), None, None);
    assert_eq!(error.unwrap_err(), LearnError::Nothing { views: 6 });
}

#[test]
fn tables_of_a_named_rig_follow_the_cameras() {
    let mut learner = learner();
    let (first, second) = (
        observation(|_| 0, 0.1, false),
        observation(|_| 2, 0.1, false),
    );
    add_views(&mut learner, [&first, &second], 50.0, 100);
    let learned = learned(&learner);
    let tables = learned.of_rig("hall", &["right", "other", "left"], Appearance::Joint);
    let tables = tables.unwrap();
    let (a, b, tables) = &tables[0];
    assert_eq!((*a, *b), (0, 2));
    assert!(tables.joint.value(3, 2, 0) > 0.8);
    assert!(learned.of_rig("cellar", &["left", "right"], Appearance::Joint).is_none());
}

#[test]
fn unseen_pairs_of_types_have_no_lift_without_data() {
    let mut learner = learner();
    let (first, second) = (
        observation(|_| 0, 0.1, false),
        observation(|_| 2, 0.1, false),
    );
    add_views(&mut learner, [&first, &second], 50.0, 100);
    let tables = learned(&learner).by_angle(Appearance::Lift);
    assert!(
        tables.at(PI * 0.9).is_none(),
        "an angle without data has no table"
    );
    let lift = &tables.at(50.0_f64.to_radians()).unwrap().exchanged;
    let lift = lift.as_ref().unwrap();
    assert!(lift.value(3, 1, 2).abs() < 1e-9);
}

#[test]
fn the_lift_is_positive_for_similar_people_only() {
    let [mut own, mut alike, mut other] = [learner(), learner(), learner()];
    let person = |part_type: u8| observation(move |_| part_type, 0.1, false);
    for [a, b] in [[0, 2], [1, 1], [2, 0]] {
        add_views(&mut own, [&person(a), &person(b)], 50.0, 40);
        add_views(&mut alike, [&person(a), &person(b)], 50.0, 10);
        add_views(&mut other, [&person(a), &person(2 - b)], 50.0, 10);
    }
    assert!(own.lift_on(&alike).unwrap() > 0.5);
    assert!(own.lift_on(&other).unwrap() < 0.0);
}

proptest! {
    #[test]
    fn joints_are_distributions_and_conditionals_are_theirs(
        cells in prop::collection::vec(0_u32..50, 9), weight in 0.1..100.0_f64,
    ) {
        let shape = shape();
        let mut counts = Counts::new(&shape);
        counts.same[7] = cells;
        let marginals = marginals(&shape, &[&counts]);
        let joint = counts.joint(&shape, &marginals, weight, false);
        prop_assert!((joint[7].sum() - 1.0).abs() < 1e-9);
        prop_assert!(joint[7].iter().all(|value| *value > 0.0));
        let tables = counts.tables(&shape, &marginals, weight, Appearance::Joint);
        let row: f64 = (0..3).map(|b| tables.conditional[0].value(7, 1, b)).sum();
        prop_assert!((row - 1.0).abs() < 1e-9);
        let back = tables.conditional[1].value(7, 2, 1) * joint[7].column(2).sum();
        prop_assert!((back - joint[7][(1, 2)]).abs() < 1e-9);
    }
}

fn example() -> Learned {
    let mut learner = learner();
    let views = [
        observation(|part| (part % 3) as u8, 0.1, false),
        observation(|_| 1, 0.2, true),
    ];
    add_views(&mut learner, [&views[0], &views[1]], 100.0, 3);
    learned(&learner)
}

#[test]
fn the_file_survives_a_round_trip_bit_for_bit() {
    let example = example();
    let text = example.write().unwrap();
    assert_eq!(Learned::parse(&text).unwrap(), example);
}

/// Returns the error for the example with one change.
fn error_of(change: impl Fn(&mut serde_json::Value)) -> String {
    let mut value = serde_json::to_value(example()).unwrap();
    change(&mut value);
    match Learned::parse(&value.to_string()) {
        Ok(_) => "fine".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_wrong_file_is_refused_with_the_field() {
    use serde_json::json;
    assert_eq!(error_of(|_| ()), "fine");
    let cases: [(&str, serde_json::Value, &str); 11] = [
        (
            "/format",
            json!("x"),
            "`x` version 1, expected `parallax-consistency` version 1",
        ),
        ("/version", json!(2), "version 2, expected"),
        (
            "/weights/alpha",
            json!(-1.0),
            "`weights.alpha` is not a number of at least 0",
        ),
        (
            "/weights/max_distance_cells",
            json!(0.0),
            "`weights.max_distance_cells` is not null or",
        ),
        (
            "/weights/appearance",
            json!("both"),
            "unknown variant `both`",
        ),
        (
            "/tau_tenths",
            json!([1.0]),
            "`tau_tenths` is not a number of at least 0 for every part",
        ),
        (
            "/smoothing",
            json!(0.0),
            "`smoothing` is not a number above 0",
        ),
        (
            "/model/shape/mirror/0",
            json!(3),
            "`model.shape.mirror` is not a list of mutual mirror parts",
        ),
        (
            "/ring/0/same/0",
            json!([1, 2]),
            "`ring[0]` is not a matrix of counts for every part",
        ),
        (
            "/rigs/0/pairs/0/cameras/0",
            json!("right"),
            "`rigs[0].pairs[0]` is not for two cameras",
        ),
        (
            "/joints/0/weights/0/0",
            json!(7.0),
            "`joints[0]` is not a row of weights with the sum 1",
        ),
    ];
    for (at, to, expected) in cases {
        let error = error_of(|file| *file.pointer_mut(at).unwrap() = to.clone());
        assert!(error.contains(expected), "{at}: {error}");
    }
}

#[test]
fn a_file_of_another_model_is_refused() {
    let other = Shape {
        n_types: vec![4; N_PARTS],
        ..shape()
    };
    let error = example().check_model(&other).unwrap_err();
    assert!(error.to_string().starts_with("the file was learned for a model with [3, 3,"));
    example().check_model(&shape()).unwrap();
}

proptest! {
    #[test]
    fn a_damaged_file_never_panics(at in 0.0..1.0_f64, to in "[-0-9eE.,\\[\\]{}a-z\"]{0,8}") {
        let mut text = example().write().unwrap();
        let at = (at * text.len() as f64) as usize;
        text.replace_range(at..(at + 3).min(text.len()), &to);
        if let Ok(read) = Learned::parse(&text) {
            let _tables = read.by_angle(Appearance::Lift);
        }
    }
}
