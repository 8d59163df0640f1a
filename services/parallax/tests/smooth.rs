//! Tests of smoothing: a run from keypoints with errors, smoothed live and afterwards, is compared with the truth. Folders that cannot be
//! smoothed are refused.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use core::fmt::Write as _;
use std::collections::BTreeMap;
use std::fs;

use nalgebra::Point3;
use runfiles::{FrameLine, JointLine, PersonLine, PlacedJoint, SmoothReport};
use scene::{RigChoice, Scene, Settings};
use serde_json::Value;

use crate::common::{Case, Ended};

const RATE_HZ: f64 = 30.0;
const N_FRAMES: usize = 50;

/// Creates a deployment of keypoints that are off by some pixels, with the truth beside it.
fn case() -> Case {
    let rig = RigChoice::Ring {
        n: 3,
        radius: 4.2,
        height: 1.5,
    };
    let settings = Settings {
        rig,
        rate_hz: RATE_HZ,
        ..Settings::default()
    };
    let scene = Scene::new(&settings).unwrap();
    let case = Case::with_rig(scene.rig(), "smooth", &[0; 3], "");
    let mut text = format!(
        "name = {:?}\nrig = \"rig.toml\"\noutput = \"out\"\n[capture]\nframe_rate_hz = {RATE_HZ:?}\n\
         [results]\noverlay_every = 0\nsmooth = true\n",
        case.name
    );
    let mut random = fastrand::Rng::with_seed(3);
    for camera in scene.rig().cameras() {
        let name = &camera.name;
        for frame in 0..N_FRAMES {
            let joints = scene.joints(frame as f64 / RATE_HZ).into_iter();
            let numbers = joints.map(|joint| {
                let at = camera.project(&Point3::from(joint)).unwrap();
                let mut off = || (0..6).map(|_| random.f64() - 0.5).sum::<f64>() * 8.0;
                format!("{:.2},{:.2},0.9", at.x + off(), at.y + off())
            });
            let person = numbers.collect::<Vec<String>>().join(",");
            let json = format!("{{\"people\":[{{\"pose_keypoints_2d\":[{person}]}}]}}");
            case.write(&format!("{name}/{name}_{frame:06}_keypoints.json"), json);
        }
        writeln!(
            text,
            "[[camera]]\nname = {name:?}\nkeypoints = {name:?}\nkeypoint_names = \"lsp-14\""
        )
        .unwrap();
    }
    case.write("deployment.toml", text);
    let mut header = scene.header();
    header.frame_rate_hz = RATE_HZ;
    let mut truth = header.to_line().unwrap() + "\n";
    for frame in 0..N_FRAMES {
        let joints = serde_json::to_string(&scene.joints(frame as f64 / RATE_HZ)).unwrap();
        writeln!(truth, "{{\"frame\":{frame},\"joints\":{joints}}}").unwrap();
    }
    case.write("truth.jsonl", truth);
    case
}

fn smooth(case: &Case, arguments: &[&str]) -> Ended {
    case.start(&[&["smooth"], arguments].concat()).wait()
}

fn lines(case: &Case, name: &str) -> Vec<FrameLine> {
    let text = fs::read_to_string(case.path(name)).unwrap();
    runfiles::lines(&text).map(Result::unwrap).collect()
}

fn mean(row: &Value, name: &str) -> f64 {
    row[name]["mean"].as_f64().unwrap()
}

fn assert_angles(case: &Case) {
    let angles = fs::read_to_string(case.path("out/angles.csv")).unwrap();
    let knee = angles
        .lines()
        .find(|line| line.starts_with("40,") && line.contains("right knee flexion"));
    let cells: Vec<&str> = knee.unwrap().split(',').collect();
    assert!(
        cells[4].parse::<f64>().is_ok() && cells[5].parse::<f64>().is_ok(),
        "{cells:?}"
    );
    assert_eq!(
        angles.lines().count() % N_FRAMES,
        1,
        "the same rows for every frame"
    );
}

#[test]
fn a_run_is_smoothed_live_and_more_accurately_afterwards() {
    let case = case();
    assert_eq!(case.run().status.code(), Some(0));
    let live = lines(&case, "out/pose3d-smooth.jsonl");
    assert_eq!(live.len(), N_FRAMES);
    let text = fs::read_to_string(case.path("out/smooth.json")).unwrap();
    let report = SmoothReport::parse(&text).unwrap();
    assert_eq!(
        (report.method.as_str(), report.n_frames),
        ("kalman", N_FRAMES as u64)
    );
    let raw = fs::read(case.path("out/pose3d.jsonl")).unwrap();
    smooth(&case, &["out", "--json"]).ends(0);
    let ended = smooth(&case, &["out", "--truth", ".", "--json"]).ends(0);
    let said: Value = serde_json::from_str(&ended.stdout).unwrap();
    let rows = said["methods"].as_array().unwrap();
    let [raw_row, rts] =
        ["raw", "rts"].map(|name| rows.iter().find(|row| row["method"] == name).unwrap());
    assert!(
        mean(rts, "position_mm") < 0.85 * mean(raw_row, "position_mm"),
        "{said:#}"
    );
    assert!(
        mean(rts, "acceleration_m_s2") < 0.4 * mean(raw_row, "acceleration_m_s2"),
        "{said:#}"
    );
    assert!(mean(rts, "lag_ms").abs() < 5.0, "{said:#}");
    assert_eq!(
        raw,
        fs::read(case.path("out/pose3d.jsonl")).unwrap(),
        "what was measured stays"
    );
    let smoothed = lines(&case, "out/pose3d-smooth.jsonl");
    assert_eq!(smoothed.len(), N_FRAMES);
    assert!(
        smoothed[40].people[0]
            .states
            .values()
            .filter(|value| *value == "measured")
            .count()
            > 10
    );
    assert_angles(&case);
    // Without `smooth`, the next run has no smoothed files, not even the files of an earlier run.
    let off = [
        "run",
        "deployment.toml",
        "--set",
        "results.smooth=false",
        "--set",
        "capture.n_frames=3",
    ];
    assert_eq!(case.start(&off).wait().status.code(), Some(0));
    assert!(
        !case.path("out/pose3d-smooth.jsonl").exists() && !case.path("out/smooth.json").exists()
    );
}

/// Returns a person with one joint.
fn person(id: u64, joint: JointLine) -> PersonLine {
    PersonLine {
        id,
        joints: BTreeMap::from([("right wrist".to_owned(), joint)]),
        status: FrameLine::OK.to_owned(),
        ..PersonLine::default()
    }
}

/// Returns a line with one joint of one person.
fn line(frame: u64, time_s: Option<f64>, joint: JointLine) -> FrameLine {
    FrameLine {
        frame,
        people: vec![person(1, joint)],
        reason: None,
        seen: None,
        status: FrameLine::OK.to_owned(),
        time_s,
        views_missing: BTreeMap::new(),
        views_present: Vec::new(),
    }
}

#[test]
fn each_of_several_people_is_smoothed_alone() {
    let case = Case::new("smooth-two", &[0], "");
    fs::create_dir(case.path("run")).unwrap();
    let at = |frame: u64, id: u64| placed(10.0 * id as f64 + 0.01 * frame as f64, 1e-4);
    // The second person is absent in frames 20 to 22, and nobody is present in frame 30. The followed person changes.
    let lines_of_two = (0..50).map(|frame| {
        let mut line = line(frame, Some(frame as f64 / 60.0), at(frame, 1));
        match frame {
            20..23 => {}
            30 => {
                line.people.clear();
                line.status = FrameLine::NO_RESULT.to_owned();
            }
            _ => line.people.insert((frame % 2) as usize, person(7, at(frame, 7))),
        }
        line
    });
    case.write("run/pose3d.jsonl", text(lines_of_two));
    let ended = smooth(&case, &["run"]).ends(0);
    assert!(ended.stdout.contains("of 2 people"), "{}", ended.stdout);
    let smoothed = lines(&case, "run/pose3d-smooth.jsonl");
    for (frame, line) in smoothed.iter().enumerate() {
        assert_eq!((line.people.len(), line.status.as_str()), (2, "ok"));
        for person in &line.people {
            let wrist = person.joints["right wrist"].placed().unwrap();
            let due = 10.0 * person.id as f64 + 0.01 * frame as f64;
            assert!(
                (wrist.position_m[0] - due).abs() < 0.01,
                "{frame}: {wrist:?}"
            );
            let is_there = frame != 30 && (person.id == 1 || !(20..23).contains(&frame));
            let state = if is_there { "measured" } else { "filled" };
            assert_eq!(
                person.states["right wrist"], state,
                "{frame}, {}",
                person.id
            );
        }
    }
    let report = fs::read_to_string(case.path("run/smooth.json")).unwrap();
    let report = SmoothReport::parse(&report).unwrap();
    let counts = |nth: usize| {
        let person = &report.people[nth];
        let joint = person.joints["right wrist"];
        (person.ids[0], joint.measured, joint.filled)
    };
    assert_eq!([counts(0), counts(1)], [(1, 49, 1), (7, 46, 4)]);
    assert!(report.people.iter().all(|person| person.frames_of_breaks.is_empty()));
}

#[test]
fn people_followed_one_after_the_other_are_smoothed_as_one_track() {
    let case = Case::new("smooth-one-after", &[0], "");
    fs::create_dir(case.path("run")).unwrap();
    let lines_of_one = (0..50).map(|frame| {
        let x = 0.01 * frame as f64;
        let mut line = line(frame, Some(frame as f64 / 60.0), placed(x, 1e-4));
        line.people[0].id = 1 + u64::from(frame > 25);
        if frame == 25 {
            line.people.clear();
        }
        line
    });
    case.write("run/pose3d.jsonl", text(lines_of_one));
    smooth(&case, &["run"]).ends(0);
    let smoothed = lines(&case, "run/pose3d-smooth.jsonl");
    let ids = smoothed.iter().map(|line| line.people[0].id);
    assert!(ids.eq((0..50).map(|frame| 1 + u64::from(frame > 25))));
    assert_eq!(smoothed[25].people[0].states["right wrist"], "filled");
    let report = fs::read_to_string(case.path("run/smooth.json")).unwrap();
    let report = SmoothReport::parse(&report).unwrap();
    let people = report.people.iter().map(|person| person.ids.clone());
    assert_eq!(people.collect::<Vec<_>>(), [vec![1, 2]]);
}

fn placed(x: f64, covariance: f64) -> JointLine {
    JointLine::Placed(PlacedJoint {
        covariance_m2: [covariance, 0.0, 0.0, covariance, 0.0, covariance],
        position_m: [x, 0.0, 1.0],
        reprojection_px: None,
        views: Vec::new(),
    })
}

fn missing() -> JointLine {
    JointLine::Missing {
        status: "too few views".to_owned(),
    }
}

fn text(lines: impl IntoIterator<Item = FrameLine>) -> String {
    lines.into_iter().map(|line| runfiles::to_line(&line).unwrap()).collect()
}

#[test]
fn smoothing_reports_missing_files_of_a_folder_by_message_and_exit_code() {
    let case = Case::new("smooth-attack", &[0], "");
    fs::create_dir(case.path("run")).unwrap();
    let at = |frame: u64| Some(frame as f64 / 60.0);
    let whole = |frame: u64| line(frame, at(frame), placed(frame as f64 * 0.01, 1e-4));
    let whole_text = text((0..50).map(whole));
    let cut = whole_text[..whole_text.len() - 30].to_owned();
    let torn = whole_text.replacen("\"frame\":20", "\"frame\":\"x\"", 1);
    let nothing = text((0..9).map(|i| line(i, at(i), missing())));
    let nan = text((0..50).map(|i| line(i, at(i), placed(i as f64 * 0.01, f64::NAN))));
    let back = text([0, 1, 3, 2, 4].map(whole));
    let no_times = text((0..50).map(|i| line(i, None, placed(0.0, 1e-4))));
    let rows: [(&str, &[&str], i32, &str); 11] = [
        (&whole_text, &[], 0, ""),
        (
            &whole_text,
            &["--method", "butterworth", "--cutoff-hz", "29"],
            2,
            "60.000 Hz",
        ),
        (&text([whole(7)]), &[], 0, ""),
        (&nothing, &[], 7, "no joint was measured"),
        (&nan, &[], 0, ""),
        (&back, &[], 4, "line 4 is at"),
        (&back, &["--rate-hz", "60"], 4, "line 4 is at"),
        (&cut, &[], 7, "line 50 of pose3d.jsonl is truncated"),
        (&torn, &[], 4, "line 21, column"),
        (&no_times, &[], 4, "--rate-hz"),
        (&no_times, &["--rate-hz", "60"], 0, ""),
    ];
    for (text, more, code, words) in rows {
        case.write("run/pose3d.jsonl", text);
        let ended = smooth(&case, &[&["run", "-q"], more].concat());
        assert_eq!(ended.status.code(), Some(code), "{words}: {}", ended.stderr);
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
        if code == 0 || code == 7 {
            let n = lines(&case, "run/pose3d-smooth.jsonl").len();
            let cut = usize::from(words.contains("is truncated"));
            assert_eq!(n, text.lines().count() - cut, "{words}");
        }
    }
    case.write("run/pose3d.jsonl", &whole_text);
    for (arguments, code, words) in [
        (&["nowhere"][..], 4, "nowhere"),
        (&[], 2, "FOLDER"),
        (&["run", "--method", "magic"], 2, "rts, butterworth"),
        (&["run", "--truth", "nowhere"], 4, "nowhere"),
        (&["run", "--up", "0,0,0"], 2, "not all 0"),
    ] {
        let ended = smooth(&case, arguments);
        assert_eq!(ended.status.code(), Some(code), "{}", ended.stderr);
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
}
