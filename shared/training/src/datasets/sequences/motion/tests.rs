//! Tests that motion files are read back as written, or refused with the cause.

use std::fmt::Write as _;
use std::fs;

use proptest::prelude::*;
use tempfile::TempDir;
use testkit::c3d::{Processor, Trial as Written};

use super::*;

/// A person moving up and down with bent knees: joints of PARSE14 in metres, z up, and toes.
fn posture(frame: usize) -> [[f64; 3]; 16] {
    let down = 0.05 * (frame as f64 * 0.3).sin();
    let z = |value: f64| value - down;
    [
        [0.0, -0.1, 0.08],
        [0.15, -0.1, z(0.5)],
        [0.0, -0.09, z(0.9)],
        [0.0, 0.09, z(0.9)],
        [0.15, 0.1, z(0.5)],
        [0.0, 0.1, 0.08],
        [0.3, -0.25, z(1.1)],
        [0.0, -0.3, z(1.15)],
        [0.0, -0.2, z(1.4)],
        [0.0, 0.2, z(1.4)],
        [0.0, 0.3, z(1.15)],
        [0.3, 0.25, z(1.1)],
        [0.0, 0.0, z(1.45)],
        [0.05, 0.0, z(1.72)],
        [0.18, -0.1, 0.02],
        [0.18, 0.1, 0.02],
    ]
}

/// Names of the markers of the preset `parallax`, or of `pose2sim` with toes.
fn names(with_toes: bool) -> Vec<String> {
    let names: Vec<&str> = if with_toes {
        vec![
            "RAnkle",
            "RKnee",
            "RHip",
            "LHip",
            "LKnee",
            "LAnkle",
            "RWrist",
            "RElbow",
            "RShoulder",
            "LShoulder",
            "LElbow",
            "LWrist",
            "Neck",
            "Head",
            "RBigToe",
            "LBigToe",
            "RSmallToe",
            "LSmallToe",
        ]
    } else {
        PARSE14.joints.iter().map(|joint| joint.name).collect()
    };
    names.into_iter().map(|name| name.replace(' ', "_")).collect()
}

/// A TRC file, y up, without the frames and markers for which `missing` returns true.
fn trc(n: usize, with_toes: bool, missing: impl Fn(usize, usize) -> bool) -> String {
    let names = names(with_toes);
    let mut text = format!(
        "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n\
         50\t50\t{n}\t{}\tm\nFrame#\tTime\t{}\t\t\n\t\tX1\tY1\tZ1\n",
        names.len(),
        names.join("\t\t\t")
    );
    for frame in 0..n {
        write!(text, "{}\t{}", frame + 1, frame as f64 / 50.0).unwrap();
        let all = posture(frame);
        for marker in 0..names.len() {
            // Both toes of a foot have the same position.
            let [x, y, z] = all[if marker < 16 { marker } else { marker - 2 }];
            if missing(frame, marker) {
                text.push_str("\t\t\t");
            } else {
                write!(text, "\t{y}\t{z}\t{x}").unwrap();
            }
        }
        text.push('\n');
    }
    text
}

fn read(
    name: &str,
    bytes: impl AsRef<[u8]>,
    options: &MotionOptions,
) -> Result<Motion, MotionError> {
    read_by(name, bytes, None, options)
}

fn read_by(
    name: &str,
    bytes: impl AsRef<[u8]>,
    table: Option<&str>,
    options: &MotionOptions,
) -> Result<Motion, MotionError> {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join(name);
    fs::write(&file, bytes).unwrap();
    let table = table.map(|table| MarkerTable::parse(table).unwrap());
    read_motion(&file, table.as_ref(), options)
}

/// Returns the error message without the folder.
fn refused(got: Result<Motion, MotionError>) -> String {
    let text = got.unwrap_err().to_string();
    text.split_once("a.").map_or(text.clone(), |parts| parts.1.to_owned())
}

fn assert_near(got: &[f64; 3], expected: &[f64; 3], tolerance: f64) {
    let off = (0..3).map(|i| (got[i] - expected[i]).abs());
    assert!(off.fold(0.0, f64::max) <= tolerance, "{got:?} {expected:?}");
}

#[test]
fn every_preset_is_a_valid_table() {
    for name in PRESETS {
        assert!(MarkerTable::preset(name).is_some(), "{name}");
    }
    assert_eq!(MarkerTable::preset("vicon"), None);
}

#[test]
fn joints_of_a_trc_file_are_read_with_z_up() {
    let got = read(
        "a.trc",
        trc(30, false, |_, _| false),
        &MotionOptions::default(),
    )
    .unwrap();
    assert_eq!((got.rate_hz, got.joints.len(), got.toes), (50.0, 30, None));
    for (frame, joints) in got.joints.iter().enumerate() {
        for (joint, expected) in joints.iter().zip(posture(frame)) {
            assert_near(joint, &expected, 1e-12);
        }
    }
    let got = read(
        "a.trc",
        trc(30, true, |_, _| false),
        &MotionOptions::default(),
    )
    .unwrap();
    let [right, left] = got.toes.unwrap()[7];
    assert_near(&right, &posture(7)[14], 1e-12);
    assert_near(&left, &posture(7)[15], 1e-12);
}

/// A C3D file of a person without toes, in the given unit.
fn c3d(unit: &str, per_metre: f64) -> Vec<u8> {
    let frame = |frame: usize| {
        let points = posture(frame).into_iter().take(14);
        points.map(|point| Some(point.map(|value| value * per_metre))).collect()
    };
    let trial = Written {
        rate_hz: 120.0,
        units: unit.to_owned(),
        labels: names(false).iter().map(|name| format!("Bob:{name}")).collect(),
        frames: (0..40).map(frame).collect(),
        n_analog: 0,
    };
    testkit::c3d::write(&trial, Processor::Intel, None)
}

/// A table with `up = "z"`, and more lines before the joints.
fn own_table(more: &str) -> String {
    let joints = PARSE14.joints.iter().map(|joint| joint.name);
    let lines = joints.map(|joint| format!("\"{joint}\" = [\"{}\"]\n", joint.replace(' ', "_")));
    format!(
        "up = \"z\"\n{more}\n[joints]\n{}",
        lines.collect::<String>()
    )
}

#[test]
fn joints_of_a_c3d_file_are_read_in_every_unit() {
    for (unit, per_metre, more) in [
        ("mm", 1000.0, ""),
        ("m", 1.0, ""),
        ("furlong", 100.0, "unit = \"cm\""),
    ] {
        let options = MotionOptions {
            frames: Some([11, 20]),
            ..MotionOptions::default()
        };
        let table = own_table(more);
        let got = read_by("a.c3d", c3d(unit, per_metre), Some(&table), &options).unwrap();
        assert_eq!((got.rate_hz, got.joints.len()), (120.0, 10));
        for (joint, expected) in got.joints[0].iter().zip(posture(10)) {
            assert_near(joint, &expected, 1e-6);
        }
    }
}

#[test]
fn short_gaps_are_interpolated_and_long_ones_are_refused_with_their_frames() {
    // At 50 frames per second, a quarter of a second is 12 frames.
    let gap =
        |from: usize, to: usize| move |frame, marker| marker == 1 && (from..=to).contains(&frame);
    let got = read(
        "a.trc",
        trc(60, false, gap(10, 21)),
        &MotionOptions::default(),
    )
    .unwrap();
    let ends = [posture(9)[1], posture(22)[1]];
    for frame in 9..=22 {
        let share = (frame - 9) as f64 / 13.0;
        let expected = core::array::from_fn(|i| ends[0][i] + share * (ends[1][i] - ends[0][i]));
        assert_near(&got.joints[frame][1], &expected, 1e-12);
    }
    let got = read(
        "a.trc",
        trc(60, false, gap(10, 22)),
        &MotionOptions::default(),
    );
    let expected = "trc: marker \"right_knee\" is missing in frames 11-23 (0.26 s); gaps are bridged up to 0.25 s";
    assert_eq!(refused(got), expected);
    let got = read(
        "a.trc",
        trc(60, false, gap(0, 3)),
        &MotionOptions::default(),
    )
    .unwrap();
    assert_near(&got.joints[0][1], &posture(4)[1], 1e-12);
    let got = read("a.trc", trc(8, false, gap(0, 7)), &MotionOptions::default());
    assert!(refused(got).contains("missing in frames 1-8"));
}

#[test]
fn impossible_motion_is_refused_with_a_likely_cause() {
    let options = MotionOptions::default();
    let by = |table: &str| refused(read_by("a.c3d", c3d("mm", 1000.0), Some(table), &options));
    let got = by(&own_table("unit = \"m\""));
    assert!(got.contains("is the unit wrong?"), "{got}");
    let sides = own_table("").replace("[\"left", "[\"L").replace("[\"right", "[\"left");
    let got = by(&sides.replace("[\"L", "[\"right"));
    assert!(got.contains("left and right are swapped"), "{got}");
    // The same motion upside down.
    let text = trc(20, false, |_, _| false);
    let upside_down: String = text
        .lines()
        .enumerate()
        .map(|(nth, line)| {
            let cells = line.split('\t').enumerate();
            let turn = |(at, cell): (usize, &str)| match cell.parse::<f64>() {
                Ok(it) if nth > 4 && at > 1 && at % 3 != 1 => (-it).to_string(),
                _ => cell.to_owned(),
            };
            cells.map(turn).collect::<Vec<_>>().join("\t") + "\n"
        })
        .collect();
    let got = refused(read("a.trc", upside_down, &options));
    assert!(got.contains("below the feet"), "{got}");
}

#[test]
fn files_that_cannot_be_used_are_refused() {
    let options = MotionOptions::default();
    let text = trc(20, false, |_, _| false);
    let got = refused(read("a.txt", &text, &options));
    assert_eq!(got, "txt: expected a file whose name ends in .c3d or .trc");
    let got = refused(read("a.trc", text.replace("neck", "collar"), &options));
    assert!(
        got.contains("match no preset") && got.contains("collar"),
        "{got}"
    );
    let got = refused(read("a.trc", text.replace("\n50\t", "\n0\t"), &options));
    assert_eq!(got, "trc: the frame rate is 0 Hz, expected 1 to 100000 Hz");
    let got = refused(read("a.trc", text.replace("\tm\n", "\tmiles\n"), &options));
    assert!(got.contains("unit \"miles\" is not known"), "{got}");
    let beyond = MotionOptions {
        frames: Some([5, 21]),
        ..options
    };
    let got = refused(read("a.trc", &text, &beyond));
    assert_eq!(got, "trc: frames 5-21 are not among the file's frames 1-20");
    let table = own_table("").replace("[\"neck\"]", "[\"C7\"]");
    let got = refused(read_by("a.trc", &text, Some(&table), &options));
    assert!(got.contains("no marker \"C7\""), "{got}");
    assert!(matches!(
        read("a.c3d", b"x", &options),
        Err(MotionError::C3d { .. })
    ));
    assert!(matches!(
        read("a.trc", b"x", &options),
        Err(MotionError::Trc { .. })
    ));
}

#[test]
fn invalid_tables_are_refused() {
    let refused =
        |from: &str, to: &str| MarkerTable::parse(&own_table("").replace(from, to)).unwrap_err();
    assert_eq!(
        refused("\"neck\" =", "# "),
        "no markers are given for the joint \"neck\""
    );
    assert!(
        refused("\"neck\" =", "\"nose\" = [\"n\"]\n\"neck\" =").contains("\"nose\" is not a joint")
    );
    let got = refused("[\"neck\"]", "{ a = 0.5, b = 0.6 }");
    assert_eq!(got, "\"neck\": the weights add up to 1.1, not to 1");
    assert!(refused("[\"neck\"]", "[]").contains("not to 1"));
    assert!(refused("\"neck\" =", "\"left toes\" = [\"t\"]\n\"neck\" =").contains("only one foot"));
    assert!(refused("up = \"z\"", "up = \"w\"").contains("unknown variant"));
}

proptest! {
    #[test]
    fn visible_frames_are_kept_and_gaps_are_interpolated(
        seen in prop::collection::vec(prop::option::weighted(0.6, -5.0..5.0_f64), 1..60),
        longest in 0_usize..8,
    ) {
        let points: Vec<Option<[f64; 3]>> = seen.iter().map(|point| point.map(|x| [x, 2.0 * x, 1.0])).collect();
        let gaps: Vec<usize> = points.split(Option::is_some).map(<[_]>::len).collect();
        let is_fine = seen.iter().any(Option::is_some) && gaps.iter().all(|gap| *gap <= longest);
        match interpolated(&points, longest as f64) {
            Err([from, to]) => {
                prop_assert!(!is_fine);
                prop_assert!(points[from..=to].iter().all(Option::is_none));
            }
            Ok(got) => {
                prop_assert!(is_fine);
                prop_assert_eq!(got.len(), points.len());
                let (low, high) = seen.iter().flatten().fold((f64::MAX, f64::MIN), |ends, x| (ends.0.min(*x), ends.1.max(*x)));
                for (got, expected) in got.iter().zip(&points) {
                    if let Some(expected) = expected {
                        prop_assert_eq!(got, expected);
                    }
                    prop_assert!(got[0] >= low - 1e-9 && got[0] <= high + 1e-9 && got[2] == 1.0);
                }
            }
        }
    }
}
