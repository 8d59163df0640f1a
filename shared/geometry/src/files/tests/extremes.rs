//! Tests that impossible and implausible values of every number of a calibration are refused or reported.

use std::error::Error as _;

use super::*;
use crate::testing::ring;

/// Result of creating and checking a rig.
#[derive(Debug, PartialEq)]
enum Outcome {
    /// The rig is refused.
    Refused,
    /// The rig is created; the value is the severity of the worst finding.
    Checked(Option<Severity>),
}

const ERROR: Outcome = Outcome::Checked(Some(Severity::Error));
const WARNING: Outcome = Outcome::Checked(Some(Severity::Warning));
const NOTE: Outcome = Outcome::Checked(Some(Severity::Note));
const FINE: Outcome = Outcome::Checked(None);

/// Creates and checks a rig. Returns the outcome with the text of the error or of the findings.
fn outcome(cameras: Vec<Camera>) -> (Outcome, String) {
    match Rig::new(cameras, Some(z_up()), "") {
        Err(error) => {
            let cause = error.source().map(|cause| format!(": {cause}"));
            let text = format!("{error}{}", cause.unwrap_or_default());
            (Outcome::Refused, text)
        }
        Ok(rig) => {
            let findings = check(&rig);
            let text: Vec<String> = findings.iter().map(ToString::to_string).collect();
            let worst = findings.iter().map(Finding::severity).max();
            (Outcome::Checked(worst), text.join("\n"))
        }
    }
}

type Change = fn(&mut Camera, f64);
type Row = (&'static str, Change, f64, Outcome, &'static str);

fn set_k(camera: &mut Camera, nth: usize, to: f64) {
    let mut k = [0.0; 6];
    k[nth] = to;
    camera.intrinsics.lens = Lens::new(LensModel::BrownConrady { k, p: [0.0; 2] });
}

const FX: Change = |camera, to| camera.intrinsics.fx = to;
const BOTH: Change = |camera, to| (camera.intrinsics.fx, camera.intrinsics.fy) = (to, to);
const CX: Change = |camera, to| camera.intrinsics.cx = to;
const CY: Change = |camera, to| camera.intrinsics.cy = to;
const K1: Change = |camera, to| set_k(camera, 0, to);
const K4: Change = |camera, to| set_k(camera, 3, to);
const FISHEYE: Change = |camera, to| {
    let k = [to, 0.0, 0.0, 0.0];
    camera.intrinsics.lens = Lens::new(LensModel::KannalaBrandt { k });
};
const P1: Change = |camera, to| {
    let (k, p) = ([0.0; 6], [to, 0.0]);
    camera.intrinsics.lens = Lens::new(LensModel::BrownConrady { k, p });
};
const TX: Change = |camera, to| camera.camera_from_world.translation.x = to;
const UNIT: Change = |camera, to| camera.camera_from_world.translation.vector *= to;
const WIDTH: Change = |camera, to| camera.intrinsics.size[0] = to as u32;

const ROWS: &[Row] = &[
    ("fx", FX, f64::NAN, Outcome::Refused, "cam1\": fx is NaN"),
    ("fx", FX, f64::INFINITY, Outcome::Refused, "fx is inf"),
    ("fx", FX, 0.0, Outcome::Refused, "focal length is 0 px"),
    (
        "fx",
        FX,
        -700.0,
        Outcome::Refused,
        "focal length is -700 px",
    ),
    ("fx", FX, 1e300, Outcome::Refused, "focal length is 1"),
    ("fx", FX, 1e-300, ERROR, "field of view is 180"),
    ("both", BOTH, 1e-300, ERROR, "field of view is 180"),
    ("both", BOTH, 1e6, ERROR, "field of view is 0.0"),
    ("both", BOTH, 1e5, WARNING, "field of view is 0.4"),
    ("fx", FX, 600.0, WARNING, "fy / fx is 1.175"),
    ("fx", FX, 100.0, ERROR, "fy / fx is 7.05"),
    ("cx", CX, f64::NAN, Outcome::Refused, "cx is NaN"),
    ("cx", CX, -1e300, Outcome::Refused, "principal point cx"),
    ("cx", CX, 1500.0, Outcome::Refused, "cx = 1500"),
    ("cx", CX, -10.0, WARNING, "-0.02 of the width"),
    ("cy", CY, 490.0, WARNING, "1.02 of the height"),
    ("cx", CX, 60.0, NOTE, "0.09 of the width"),
    (
        "k1",
        K1,
        f64::NAN,
        Outcome::Refused,
        "a lens coefficient is NaN",
    ),
    ("k1", K1, 4e9, Outcome::Refused, "lens coefficient is 4e9"),
    ("k1", K1, -4e9, Outcome::Refused, "lens coefficient is -4e9"),
    ("k1", K1, 4e6, ERROR, "from the optical axis"),
    ("k1", K1, 40.0, WARNING, "from the optical axis"),
    ("k1", K1, -4e3, ERROR, "100 % of the image"),
    ("k1", K1, -1.0, WARNING, "of the image"),
    ("k1", K1, -0.3, FINE, ""),
    ("k4", K4, -4e6, ERROR, "of the image"),
    (
        "p1",
        P1,
        1e300,
        Outcome::Refused,
        "lens coefficient is 1e300",
    ),
    ("p1", P1, 5.0, ERROR, "of the image"),
    ("fisheye k1", FISHEYE, -100.0, ERROR, "of the image"),
    ("fisheye k1", FISHEYE, 0.1, FINE, ""),
    ("tx", TX, f64::NAN, Outcome::Refused, "translation is NaN"),
    ("tx", TX, 3e307, Outcome::Refused, "3e307 m"),
    ("tx", TX, -1e200, Outcome::Refused, "1e200 m"),
    ("tx", TX, 2e7, Outcome::Refused, "2e7 m"),
    ("tx", TX, 1e6, ERROR, "1.0e6 m apart"),
    ("unit", UNIT, 1e3, ERROR, "m apart: is the unit right"),
    ("unit", UNIT, 0.0, WARNING, ""),
    ("width", WIDTH, 0.0, Outcome::Refused, "image size is 0x480"),
    ("width", WIDTH, 1.0, Outcome::Refused, "cx = 320"),
    (
        "width",
        WIDTH,
        4e9,
        Outcome::Checked(Some(Severity::Error)),
        "of the width",
    ),
];

#[test]
fn impossible_numbers_of_a_camera_are_refused_or_reported() {
    let mut wrong = Vec::new();
    for (field, change, value, expected, expected_text) in ROWS {
        let mut cameras = ring(3, LensModel::Pinhole);
        change(&mut cameras[1], *value);
        let (outcome, text) = outcome(cameras);
        if outcome != *expected || !text.contains(expected_text) {
            wrong.push(format!(
                "{field} = {value:e}: {outcome:?}, lacks {expected_text:?}:\n{text}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns the outcome for three cameras that are all changed.
fn outcome_of_all(change: impl Fn(&mut Camera)) -> (Outcome, String) {
    let mut cameras = ring(3, LensModel::Pinhole);
    cameras.iter_mut().for_each(change);
    outcome(cameras)
}

#[test]
fn a_rig_in_another_unit_is_an_error_with_its_distances() {
    for per_metre in [100.0, 1000.0] {
        let (outcome, text) =
            outcome_of_all(|camera| camera.camera_from_world.translation.vector *= per_metre);
        assert_eq!(outcome, ERROR, "{text}");
        assert!(text.contains("cam0 and cam1 are 5"), "{text}");
    }
    let (outcome, text) =
        outcome_of_all(|camera| camera.camera_from_world.translation.vector /= 1000.0);
    assert_eq!(outcome, ERROR, "{text}");
    assert!(text.contains("in one place"), "{text}");
}

#[test]
fn cameras_at_the_same_position_are_an_error() {
    let turn = |nth: usize| {
        let mut camera = ring(1, LensModel::Pinhole).remove(0);
        camera.name = format!("cam{nth}");
        let turn = nalgebra::Isometry3::rotation(Vector3::y() * 0.2 * nth as f64);
        camera.camera_from_world = turn * camera.camera_from_world;
        camera
    };
    let (outcome, text) = outcome((0..3).map(turn).collect());
    assert_eq!(outcome, ERROR, "{text}");
    assert!(
        text.contains("3 cameras are in one place (at most 0.0 mm apart)"),
        "{text}"
    );
}

#[test]
fn cameras_that_all_look_away_are_an_error() {
    // After a rotation by 180 degrees about the vertical axis, every camera looks out of the ring.
    let turn = nalgebra::Isometry3::rotation(Vector3::y() * core::f64::consts::PI);
    let (outcome, text) =
        outcome_of_all(|camera| camera.camera_from_world = turn * camera.camera_from_world);
    assert_eq!(outcome, ERROR, "{text}");
    assert!(
        text.contains("no two of the 3 cameras see a common place"),
        "{text}"
    );
}

#[test]
fn a_rig_of_one_camera_has_no_findings() {
    let (outcome, text) = outcome(ring(1, LensModel::Pinhole));
    assert_eq!(outcome, FINE, "{text}");
}

#[test]
fn the_unit_option_also_applies_to_a_parallax_file() {
    let rig = ring_rig(2, LensModel::Pinhole);
    let options = ReadOptions {
        unit: Some(Unit::Millimetres),
        ..ReadOptions::default()
    };
    let read = own::parse(&own::write(&rig), &options).expect("ours");
    let [a, b] = [&read, &rig].map(|rig| rig.cameras()[1].camera_from_world.translation.vector);
    assert!((a * 1000.0 - b).norm() < 1e-9);
}
