//! Every number of a calibration with values that cannot be, or can hardly be: refused, or named.

use std::error::Error as _;

use super::*;
use crate::testing::ring;

/// What becomes of a rig.
#[derive(Debug, PartialEq)]
enum Fate {
    /// It is no rig.
    Refused,
    /// The worst that is found.
    Found(Option<Severity>),
}

const ERROR: Fate = Fate::Found(Some(Severity::Error));
const WARNING: Fate = Fate::Found(Some(Severity::Warning));
const NOTE: Fate = Fate::Found(Some(Severity::Note));
const FINE: Fate = Fate::Found(None);

/// What becomes of cameras, and what is said.
fn fate(cameras: Vec<Camera>) -> (Fate, String) {
    match Rig::new(cameras, Some(z_up()), "") {
        Err(error) => {
            let cause = error.source().map(|it| format!(": {it}"));
            let said = format!("{error}{}", cause.unwrap_or_default());
            (Fate::Refused, said)
        }
        Ok(rig) => {
            let findings = check(&rig);
            let said: Vec<String> = findings.iter().map(ToString::to_string).collect();
            let worst = findings.iter().map(Finding::severity).max();
            (Fate::Found(worst), said.join("\n"))
        }
    }
}

type Spoil = fn(&mut Camera, f64);
type Row = (&'static str, Spoil, f64, Fate, &'static str);

fn set_k(camera: &mut Camera, nth: usize, to: f64) {
    let mut k = [0.0; 6];
    k[nth] = to;
    camera.intrinsics.lens = Lens::new(LensModel::BrownConrady { k, p: [0.0; 2] });
}

const FX: Spoil = |camera, to| camera.intrinsics.fx = to;
const BOTH: Spoil = |camera, to| (camera.intrinsics.fx, camera.intrinsics.fy) = (to, to);
const CX: Spoil = |camera, to| camera.intrinsics.cx = to;
const CY: Spoil = |camera, to| camera.intrinsics.cy = to;
const K1: Spoil = |camera, to| set_k(camera, 0, to);
const K4: Spoil = |camera, to| set_k(camera, 3, to);
const FISHEYE: Spoil = |camera, to| {
    let k = [to, 0.0, 0.0, 0.0];
    camera.intrinsics.lens = Lens::new(LensModel::KannalaBrandt { k });
};
const P1: Spoil = |camera, to| {
    let (k, p) = ([0.0; 6], [to, 0.0]);
    camera.intrinsics.lens = Lens::new(LensModel::BrownConrady { k, p });
};
const TX: Spoil = |camera, to| camera.camera_from_world.translation.x = to;
const UNIT: Spoil = |camera, to| camera.camera_from_world.translation.vector *= to;
const WIDTH: Spoil = |camera, to| camera.intrinsics.size[0] = to as u32;

const ROWS: &[Row] = &[
    ("fx", FX, f64::NAN, Fate::Refused, "cam1\": fx is NaN"),
    ("fx", FX, f64::INFINITY, Fate::Refused, "fx is inf"),
    ("fx", FX, 0.0, Fate::Refused, "focal length 0 px"),
    ("fx", FX, -700.0, Fate::Refused, "focal length -700 px"),
    ("fx", FX, 1e300, Fate::Refused, "focal length 1"),
    ("fx", FX, 1e-300, ERROR, "field of view is 180"),
    ("both", BOTH, 1e-300, ERROR, "field of view is 180"),
    ("both", BOTH, 1e6, ERROR, "field of view is 0.0"),
    ("both", BOTH, 1e5, WARNING, "field of view is 0.4"),
    ("fx", FX, 600.0, WARNING, "fy / fx is 1.175"),
    ("fx", FX, 100.0, ERROR, "fy / fx is 7.05"),
    ("cx", CX, f64::NAN, Fate::Refused, "cx is NaN"),
    ("cx", CX, -1e300, Fate::Refused, "principal point cx"),
    ("cx", CX, 1500.0, Fate::Refused, "cx = 1500"),
    ("cx", CX, -10.0, WARNING, "-0.02 of the width"),
    ("cy", CY, 490.0, WARNING, "1.02 of the height"),
    ("cx", CX, 60.0, NOTE, "0.09 of the width"),
    (
        "k1",
        K1,
        f64::NAN,
        Fate::Refused,
        "a lens coefficient is NaN",
    ),
    ("k1", K1, 4e9, Fate::Refused, "lens coefficient 4e9"),
    ("k1", K1, -4e9, Fate::Refused, "lens coefficient -4e9"),
    ("k1", K1, 4e6, ERROR, "off the axis"),
    ("k1", K1, 40.0, WARNING, "off the axis"),
    ("k1", K1, -4e3, ERROR, "100 % of the image"),
    ("k1", K1, -1.0, WARNING, "of the image"),
    ("k1", K1, -0.3, FINE, ""),
    ("k4", K4, -4e6, ERROR, "of the image"),
    ("p1", P1, 1e300, Fate::Refused, "lens coefficient 1e300"),
    ("p1", P1, 5.0, ERROR, "of the image"),
    ("fisheye k1", FISHEYE, -100.0, ERROR, "of the image"),
    ("fisheye k1", FISHEYE, 0.1, FINE, ""),
    ("tx", TX, f64::NAN, Fate::Refused, "translation is NaN"),
    ("tx", TX, 3e307, Fate::Refused, "3e307 m"),
    ("tx", TX, -1e200, Fate::Refused, "1e200 m"),
    ("tx", TX, 2e7, Fate::Refused, "2e7 m"),
    ("tx", TX, 1e6, ERROR, "1.0e6 m apart"),
    ("unit", UNIT, 1e3, ERROR, "m apart: is the unit right"),
    ("unit", UNIT, 0.0, WARNING, ""),
    ("width", WIDTH, 0.0, Fate::Refused, "image size is 0x480"),
    ("width", WIDTH, 1.0, Fate::Refused, "cx = 320"),
    (
        "width",
        WIDTH,
        4e9,
        Fate::Found(Some(Severity::Error)),
        "of the width",
    ),
];

#[test]
fn every_number_of_a_camera_is_refused_or_named_where_it_cannot_be() {
    let mut wrong = Vec::new();
    for (field, spoil, value, expected, words) in ROWS {
        let mut cameras = ring(3, LensModel::Pinhole);
        spoil(&mut cameras[1], *value);
        let (fate, said) = fate(cameras);
        if fate != *expected || !said.contains(words) {
            wrong.push(format!(
                "{field} = {value:e}: {fate:?}, lacks {words:?}:\n{said}"
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What becomes of three cameras all of which are changed.
fn all(spoil: impl Fn(&mut Camera)) -> (Fate, String) {
    let mut cameras = ring(3, LensModel::Pinhole);
    cameras.iter_mut().for_each(spoil);
    fate(cameras)
}

#[test]
fn a_rig_in_another_unit_is_an_error_with_its_distances() {
    for per_metre in [100.0, 1000.0] {
        let (fate, said) = all(|it| it.camera_from_world.translation.vector *= per_metre);
        assert_eq!(fate, ERROR, "{said}");
        assert!(said.contains("cam0 and cam1 are 5"), "{said}");
    }
    let (fate, said) = all(|it| it.camera_from_world.translation.vector /= 1000.0);
    assert_eq!(fate, ERROR, "{said}");
    assert!(said.contains("at one place"), "{said}");
}

#[test]
fn cameras_at_one_place_are_an_error() {
    let turn = |nth: usize| {
        let mut camera = ring(1, LensModel::Pinhole).remove(0);
        camera.name = format!("cam{nth}");
        let turn = nalgebra::Isometry3::rotation(Vector3::y() * 0.2 * nth as f64);
        camera.camera_from_world = turn * camera.camera_from_world;
        camera
    };
    let (fate, said) = fate((0..3).map(turn).collect());
    assert_eq!(fate, ERROR, "{said}");
    assert!(
        said.contains("3 cameras are at one place (at most 0.0 mm apart)"),
        "{said}"
    );
}

#[test]
fn cameras_that_all_look_away_share_nothing() {
    // Half a turn about its own vertical: out of the ring.
    let turn = nalgebra::Isometry3::rotation(Vector3::y() * core::f64::consts::PI);
    let (fate, said) = all(|it| it.camera_from_world = turn * it.camera_from_world);
    assert_eq!(fate, ERROR, "{said}");
    assert!(
        said.contains("no place in space is seen by two of the 3 cameras"),
        "{said}"
    );
}

#[test]
fn one_camera_alone_is_no_mistake_of_the_file() {
    let (fate, said) = fate(ring(1, LensModel::Pinhole));
    assert_eq!(fate, FINE, "{said}");
}

#[test]
fn the_unit_that_is_asked_for_counts_for_a_file_of_ours_too() {
    let rig = ring_rig(2, LensModel::Pinhole);
    let options = ReadOptions {
        unit: Some(Unit::Millimetres),
        ..ReadOptions::default()
    };
    let read = own::parse(&own::write(&rig), &options).expect("ours");
    let [a, b] = [&read, &rig].map(|it| it.cameras()[1].camera_from_world.translation.vector);
    assert!((a * 1000.0 - b).norm() < 1e-9);
}
