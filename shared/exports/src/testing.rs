//! Test data: a person who walks in place, and a camera that sees the person.

use std::collections::BTreeMap;

use geometry::{Camera, Intrinsics, Lens};
use nalgebra::{Isometry3, Point3, Rotation3, UnitQuaternion, Vector3};
use runfiles::{FrameLine, JointLine, PersonLine, PlacedJoint};
use skeleton::PARSE14;

use crate::{Gathering, Trial, ViewCamera};

/// Returns the line of a frame in which every joint was found.
pub(crate) fn line(frame: u64, rate_hz: Option<f64>) -> FrameLine {
    let time = frame as f64 / 30.0;
    let swing = |phase: f64, side: f64, up: f64, out: f64| {
        let angle = 0.6 * (4.0 * time + phase).sin();
        Vector3::new(side + out, up * angle.sin(), up * angle.cos())
    };
    let hip = |side: f64| Vector3::new(side, 0.02 * time.sin(), 0.95);
    let knee = |side: f64, phase| hip(side) + swing(phase, 0.0, -0.45, 0.02);
    let ankle = |side: f64, phase| knee(side, phase) + swing(phase - 0.7, 0.0, -0.42, 0.0);
    let shoulder = |side: f64| Vector3::new(side, 0.01, 1.45);
    let elbow = |side: f64, phase| shoulder(side) + swing(phase, 0.0, -0.3, 0.05 * side.signum());
    let wrist = |side: f64, phase| elbow(side, phase) + swing(phase + 0.9, 0.0, -0.27, 0.0);
    let place = |name: &str| match name {
        "right hip" => hip(-0.1),
        "left hip" => hip(0.1),
        "right knee" => knee(-0.1, 0.0),
        "left knee" => knee(0.1, 3.0),
        "right ankle" => ankle(-0.1, 0.0),
        "left ankle" => ankle(0.1, 3.0),
        "right shoulder" => shoulder(-0.2),
        "left shoulder" => shoulder(0.2),
        "right elbow" => elbow(-0.2, 3.0),
        "left elbow" => elbow(0.2, 0.0),
        "right wrist" => wrist(-0.2, 3.0),
        "left wrist" => wrist(0.2, 0.0),
        "neck" => Vector3::new(0.0, 0.03 * (2.0 * time).sin(), 1.5),
        _ => Vector3::new(0.0, 0.05, 1.72),
    };
    let joint = |name: &'static str| {
        let placed = PlacedJoint {
            covariance_m2: [4e-4, 1e-4, 0.0, 4e-4, 0.0, 1e-4],
            position_m: place(name).into(),
            reprojection_px: Some(1.5),
            views: vec!["left".to_owned(), "right".to_owned()],
        };
        (name.to_owned(), JointLine::Placed(placed))
    };
    let person = PersonLine {
        id: 1,
        joints: PARSE14.joints.iter().map(|entry| joint(entry.name)).collect(),
        pairs: 1,
        status: FrameLine::OK.to_owned(),
        ..PersonLine::default()
    };
    FrameLine {
        frame,
        people: vec![person],
        reason: None,
        seen: None,
        status: FrameLine::OK.to_owned(),
        time_s: rate_hz.map(|rate_hz| frame as f64 / rate_hz),
        views_missing: BTreeMap::new(),
        views_present: Vec::new(),
    }
}

/// Returns frames of the person at 30 Hz, z up, from frame 10 on.
pub(crate) fn walker(n: u64) -> Trial {
    let mut all = Gathering::new(vec!["left".to_owned(), "right".to_owned()]);
    for frame in 10..10 + n {
        all.push(&line(frame, Some(30.0))).unwrap();
    }
    let mut trial = all.finish("walk", None).unwrap().remove(0);
    trial.up_in_world = Some(Vector3::z_axis());
    trial
}

/// Returns a camera that sees the whole person.
pub(crate) fn camera() -> ViewCamera {
    let axes = nalgebra::Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let stand = Point3::new(0.0, -4.0, 0.9);
    let camera = Camera {
        name: "left".to_owned(),
        intrinsics: Intrinsics {
            fx: 400.0,
            fy: 400.0,
            cx: 159.5,
            cy: 119.5,
            size: [320, 240],
            lens: Lens::default(),
        },
        camera_from_world: Isometry3::from_parts((-(turn * stand.coords)).into(), turn),
    };
    ViewCamera {
        name: "left".to_owned(),
        camera,
        picture_from_camera: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        size: [320, 240],
    }
}
