//! Tests of the maps made from another program's keypoints.

use keypoints::{BODY_25, COCO_17, joint_ways};

use super::*;
use crate::found::NOWHERE;

/// A person 400 pixels high near column 300. All scores are 0.8; the neck is the second keypoint.
fn person() -> Vec<Option<Keypoint>> {
    let keypoint = |nth: usize| Keypoint {
        at: [
            250.0 + 10.0 * (nth % 11) as f64,
            100.0 + 400.0 * nth as f64 / 24.0,
        ],
        score: 0.8,
    };
    (0..25).map(|nth| Some(keypoint(nth))).collect()
}

fn ways(names: &[&str]) -> Vec<Vec<Way>> {
    let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
    joint_ways(&names)
}

fn maps(keypoints: &[Option<Keypoint>]) -> JointMaps {
    let mut maps = JointMaps::default();
    maps.of_keypoints(keypoints, &ways(&BODY_25), &SETTINGS, 0.02);
    maps
}

const SETTINGS: MapSettings = MapSettings {
    eps: 0.02,
    point_sigma: 0.0,
};
/// Index of the neck in `skeleton::PARSE14` and in `body-25`.
const NECK: usize = 12;
const NECK_25: usize = 1;

#[test]
fn the_map_of_a_joint_has_its_maximum_at_the_keypoint_with_the_value_of_the_score() {
    let keypoints = person();
    let maps = maps(&keypoints);
    assert_eq!(PARSE14.joints[NECK].name, "neck");
    let neck = keypoints[NECK_25].unwrap();
    assert_eq!(maps.peaks()[NECK], Some(neck));
    let (at, value) = maps.maxima(NECK, 1)[0];
    let away = (at[0] - neck.at[0]).hypot(at[1] - neck.at[1]);
    assert!(away < 1e-3, "{away}");
    let here = maps.at(NECK, neck.at);
    for value in [here, value] {
        assert!((value - 0.82_f32.ln()).abs() < 1e-5, "{value}");
    }
    // One standard deviation away from the peak of the Gaussian: 0.02 of the 500-pixel box.
    let beside = maps.at(NECK, [neck.at[0] + 10.0, neck.at[1]]);
    let expected = (0.8 * (-0.5_f32).exp() + 0.02).ln();
    assert!((beside - expected).abs() < 0.05, "{beside} {expected}");
}

#[test]
fn an_extra_keypoint_is_returned_with_its_deviation() {
    let mut keypoints = person();
    let heel = BODY_25.iter().position(|name| *name == "left heel").unwrap();
    let mut maps = maps(&keypoints);
    let (found, sigma_px) = maps.keypoint(heel).unwrap();
    assert_eq!(Some(found), keypoints[heel]);
    assert!(
        (sigma_px - 10.0).abs() < 1e-9,
        "0.02 of the box of 500 pixels: {sigma_px}"
    );
    assert_eq!(maps.keypoint(25), None);
    keypoints[heel] = None;
    maps.of_keypoints(&keypoints, &ways(&BODY_25), &SETTINGS, 0.02);
    assert_eq!(maps.keypoint(heel), None);
    assert_eq!(JointMaps::default().keypoint(0), None);
}

#[test]
fn a_map_has_the_floor_value_far_from_the_joint_and_outside_the_box() {
    let maps = maps(&person());
    assert_eq!(maps.floor(), 0.02_f32.ln());
    for point in [[300.0, 450.0], [300.0, -500.0], [f64::NAN, 0.0]] {
        let got = maps.at(NECK, point);
        assert!((got - maps.floor()).abs() < 1e-3, "{point:?}: {got}");
    }
}

#[test]
fn joints_of_a_keypoint_that_was_not_found_are_missing() {
    for lost in [None, Some(NOWHERE)] {
        let mut keypoints = person();
        keypoints[NECK_25] = lost;
        keypoints[2] = lost;
        let maps = maps(&keypoints);
        assert_eq!(maps.peaks()[NECK], None);
        assert_eq!(maps.maxima(NECK, 3), []);
        // The head is not known without the neck; the left hip does not depend on it.
        assert_eq!(maps.peaks()[13], None);
        assert!(maps.peaks()[3].is_some());
    }
}

#[test]
fn a_head_estimated_from_one_ear_has_a_larger_deviation() {
    let mut keypoints = person();
    let all = maps(&keypoints);
    // In a profile, both eyes and the left ear are not seen.
    for hidden in [15, 16, 18] {
        keypoints[hidden] = None;
    }
    let one = maps(&keypoints);
    assert!(one.peaks()[13].is_some());
    let sigma = |maps: &JointMaps| maps.expected_px(13).unwrap();
    let added = (sigma(&one).powi(2) - sigma(&all).powi(2)).sqrt();
    assert!((added - 0.05 * 500.0).abs() < 1e-6, "{added}");
    keypoints[17] = None;
    assert!(maps(&keypoints).expected_px(13).unwrap() > sigma(&one));
}

#[test]
fn a_derived_joint_has_the_lowest_score_of_its_keypoints() {
    let mut keypoints = person();
    keypoints.truncate(17);
    keypoints[5] = Some(Keypoint {
        at: [200.0, 150.0],
        score: 0.3,
    });
    keypoints[6] = Some(Keypoint {
        at: [240.0, 170.0],
        score: 0.9,
    });
    let mut maps = JointMaps::default();
    assert!(maps.of_keypoints(&keypoints, &ways(&COCO_17), &SETTINGS, 0.02));
    let neck = maps.peaks()[NECK].unwrap();
    assert_eq!((neck.at, neck.score), ([220.0, 160.0], 0.3));
    let here = maps.at(NECK, neck.at);
    assert!((here - 0.32_f32.ln()).abs() < 0.05, "{here}");
}

#[test]
fn without_keypoints_the_maps_have_the_floor_value_and_no_trace_of_earlier_frames() {
    let mut maps = maps(&person());
    for keypoints in [vec![None; 25], vec![Some(NOWHERE); 25]] {
        let is_there = maps.of_keypoints(&keypoints, &ways(&BODY_25), &SETTINGS, 0.02);
        assert!(!is_there);
        assert_eq!(maps.peaks(), [None; N_JOINTS]);
        assert_eq!(maps.at(NECK, [300.0, 116.0]), maps.floor());
        assert_eq!(maps.maxima(NECK, 3), []);
        maps.exchange_sides();
        maps.shift([1.0, 2.0]);
    }
}

#[test]
fn small_and_unusual_boxes_also_give_maps() {
    let one = |at: [f64; 2]| {
        let mut keypoints = vec![None; 25];
        keypoints[NECK_25] = Some(Keypoint { at, score: 1.0 });
        keypoints
    };
    let mut far = one([-1e6, 1e6]);
    far[0] = Some(Keypoint {
        at: [1e6, -1e6],
        score: 1.0,
    });
    for keypoints in [one([5.0, 5.0]), far] {
        let maps = maps(&keypoints);
        let at = keypoints[NECK_25].unwrap().at;
        assert!(maps.at(NECK, at) > maps.floor() + 1.0);
        assert!(maps.values.iter().all(|value| value.is_finite()));
    }
}

#[test]
fn frames_after_the_first_do_not_allocate_memory() {
    let mut maps = maps(&person());
    let before = [maps.values.capacity(), maps.peaks.capacity()];
    // The widest possible grid.
    let mut wide = vec![None; 25];
    for (nth, x) in [(0, 0.0), (1, 5000.0)] {
        wide[nth] = Some(Keypoint {
            at: [x, 9.0],
            score: 1.0,
        });
    }
    maps.of_keypoints(&wide, &ways(&BODY_25), &SETTINGS, 0.02);
    assert_eq!([maps.values.capacity(), maps.peaks.capacity()], before);
}

#[test]
fn shifting_the_maps_moves_their_values() {
    let mut maps = maps(&person());
    let before = maps.at(NECK, [262.0, 118.0]);
    maps.shift([100.0, -30.0]);
    let after = maps.at(NECK, [362.0, 88.0]);
    assert!((before - after).abs() < 1e-4, "{before} {after}");
}
