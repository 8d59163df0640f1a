//! Properties of the joints of a person made of segments.

use proptest::prelude::*;
use testkit::c3d::{Processor, Trial, write};

use super::*;

/// A person with straight limbs, in mm (z up, x forwards, y to the left): segments with their origins and proximal ends.
const STANDING: [(&str, [f64; 3]); 13] = [
    ("PEL", [0.0, 0.0, 1000.0]),
    ("TRX", [0.0, 0.0, 1450.0]),
    ("HED", [20.0, 0.0, 1500.0]),
    ("LCL", [0.0, 180.0, 1430.0]),
    ("LHU", [0.0, 180.0, 1130.0]),
    ("LRA", [0.0, 180.0, 880.0]),
    ("RCL", [0.0, -180.0, 1430.0]),
    ("RHU", [0.0, -180.0, 1130.0]),
    ("RRA", [0.0, -180.0, 880.0]),
    ("LFE", [0.0, 100.0, 520.0]),
    ("LTI", [0.0, 100.0, 90.0]),
    ("RFE", [0.0, -100.0, 520.0]),
    ("RTI", [0.0, -100.0, 90.0]),
];

/// A trial with all points that are needed. The person has a different position in every frame.
pub(crate) fn person(places: &[Isometry3<f64>]) -> Trial {
    let mut labels = Vec::new();
    let mut points = Vec::new();
    for (name, origin) in STANDING {
        let proximal = match name {
            "LFE" | "RFE" => 430.0,
            _ => 100.0,
        };
        let ends = [
            ("O", [0.0; 3]),
            ("P", [0.0, 0.0, proximal]),
            ("A", [100.0, 0.0, 0.0]),
            ("L", [0.0, 100.0, 0.0]),
        ];
        for (axis, end) in ends {
            labels.push(format!("S1:{name}{axis}"));
            points.push(Point3::from([0, 1, 2].map(|i| origin[i] + end[i])));
        }
    }
    for (nth, names) in MARKERS.iter().enumerate() {
        labels.push(names[nth % names.len()].to_owned());
        let side = if names[0].starts_with('R') { -1.0 } else { 1.0 };
        points.push(Point3::new(50.0, side * 200.0, 900.0 + nth as f64));
    }
    let frame =
        |place: &Isometry3<f64>| points.iter().map(|point| Some((place * point).into())).collect();
    Trial {
        rate_hz: 120.0,
        units: "mm".to_owned(),
        labels,
        frames: places.iter().map(frame).collect(),
        n_analog: 0,
    }
}

fn read(trial: &Trial) -> C3d {
    C3d::parse(&write(trial, Processor::Intel, None)).unwrap()
}

fn joints(places: &[Isometry3<f64>], measures: Measures, at: f64) -> Option<[Point; 20]> {
    let trial = read(&person(places));
    Body::new(&trial, measures).unwrap().joints(at)
}

fn assert_near(got: Point, expected: Point, what: &str) {
    let off = (Vector3::from(got) - Vector3::from(expected)).norm();
    assert!(off < 0.01, "{what}: {got:?}, expected {expected:?}");
}

#[test]
fn without_corrections_the_joints_are_the_origins() {
    let here = Isometry3::identity();
    let got = joints(&[here, here], Measures::default(), 1.0).unwrap();
    for (joint, expected) in [
        (0, [-50.0, 0.0, 1450.0]),
        (1, [-50.0, 0.0, 1000.0]),
        (2, [0.0, 180.0, 1430.0]),
        (3, [0.0, 180.0, 1130.0]),
        (5, [0.0, 180.0, 880.0]),
        (9, [0.0, -180.0, 880.0]),
        (10, [0.0, 100.0, 950.0]),
        (12, [0.0, 100.0, 520.0]),
        (17, [0.0, -100.0, 90.0]),
        (18, [0.0, 0.0, 1450.0]),
        (19, [0.0, 0.0, 1450.0 + 316.103]),
    ] {
        let name = skeleton::HUMANEVA20.joints[joint].name;
        assert_near(got[joint], expected, name);
    }
}

#[test]
fn the_trunk_leans_back_and_the_elbows_come_forwards() {
    let here = Isometry3::identity();
    let measures = Measures {
        half_shoulders: 180.0,
        shoulder_offsets: [50.0, 0.0],
    };
    let got = joints(&[here, here], measures, 1.0).unwrap();
    let lean = (90.0_f64 / 450.0).atan();
    let top = [-50.0 - 450.0 * lean.sin(), 0.0, 1000.0 + 450.0 * lean.cos()];
    assert_near(got[0], top, "top of the trunk");
    let turn = (25.0_f64 / 300.0).atan();
    let elbow = [-300.0 * turn.sin(), 180.0, 1430.0 - 300.0 * turn.cos()];
    assert_near(got[3], elbow, "left elbow");
    assert_near(got[4], got[3], "the forearm begins at the elbow");
    assert_near(got[7], [0.0, -180.0, 1130.0], "right elbow");
}

#[test]
fn a_lost_marker_invalidates_the_frames_around_it() {
    let here = Isometry3::identity();
    let mut trial = person(&[here; 4]);
    let lost = trial.labels.iter().position(|label| label == "T10").unwrap();
    trial.frames[2][lost] = None;
    let trial = read(&trial);
    let body = Body::new(&trial, Measures::default()).unwrap();
    let known = [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0].map(|at| body.joints(at).is_some());
    assert_eq!(known, [true, true, true, false, false, false, true]);
}

#[test]
fn there_are_no_joints_outside_of_the_trial() {
    let here = Isometry3::identity();
    let trial = read(&person(&[here; 2]));
    let body = Body::new(&trial, Measures::default()).unwrap();
    for at in [0.9, 2.1, -5.0, f64::NAN] {
        assert_eq!(body.joints(at), None, "{at}");
    }
}

#[test]
fn a_missing_point_is_named() {
    let mut trial = person(&[Isometry3::identity()]);
    let at = trial.labels.iter().position(|label| label == "S1:LTIO").unwrap();
    trial.labels[at] = "other".to_owned();
    let trial = read(&trial);
    let got = Body::new(&trial, Measures::default());
    assert_eq!(got.err().as_deref(), Some("LTIO"));
}

#[test]
fn body_measures_come_from_the_static_trial_and_the_subject_file() {
    let still = read(&person(&[Isometry3::identity(); 3]));
    let text = "$HeadOffset = 3\n$LShoulderOffset = 50.5\n$RShoulderOffset = 48\n";
    let got = Measures::new(&still, text).unwrap();
    assert_eq!(got.shoulder_offsets, [50.5, 48.0]);
    // Distance between this person's shoulder markers, which differ by 400 mm across and by 7 mm in height.
    let apart = (400.0_f64 * 400.0 + 49.0).sqrt();
    assert!((got.half_shoulders - (apart / 2.0 - 7.0)).abs() < 0.01);
    assert_eq!(Measures::new(&still, "$LShoulderOffset = 50"), None);
}

proptest! {
    #[test]
    fn joints_move_with_the_person(
        shift in prop::array::uniform3(-2000.0..2000.0_f64),
        axis in prop::array::uniform3(-2.0..2.0_f64),
        offsets in prop::array::uniform2(20.0..80.0_f64),
    ) {
        let here = Isometry3::identity();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(axis));
        let there = Isometry3::from_parts(Translation3::from(shift), turn);
        let measures = Measures { half_shoulders: 180.0, shoulder_offsets: offsets };
        let got = joints(&[there, there], measures, 1.0).unwrap();
        let expected = joints(&[here, here], measures, 1.0).unwrap();
        for (got, expected) in got.iter().zip(expected) {
            let off = Point3::from(*got) - there * Point3::from(expected);
            prop_assert!(off.norm() < 0.05, "{}", off.norm());
        }
    }

    #[test]
    fn joints_are_interpolated_between_frames(share in 0.0..1.0_f64, far in -500.0..500.0_f64) {
        let places = [0.0, far].map(|x| Isometry3::translation(x, 0.0, 0.0));
        let got = joints(&places, Measures::default(), 1.0 + share).unwrap();
        let expected = joints(&[places[0]; 2], Measures::default(), 1.0).unwrap();
        for (got, expected) in got.iter().zip(expected) {
            prop_assert!((got[0] - expected[0] - share * far).abs() < 0.05);
        }
    }
}
