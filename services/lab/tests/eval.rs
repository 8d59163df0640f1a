//! `parallax-lab eval`, preceded by `parallax-lab train consistency`, as a user starts them: files, resuming after an interruption, and
//! errors.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::fs;
use std::path::PathBuf;

use common::{Case, Ended, PLAIN, planted};
use serde_json::Value;

/// Makes a sequence of `n_frames` with ground truth: three views of a synthetic walking figure.
fn case(n_frames: usize, n_true: usize) -> Case {
    let case = Case::new("eval", &[n_frames; 3], PLAIN);
    let markers: Vec<String> = (0..14).map(|i| format!("M{i}")).collect();
    let row = |frame: usize| {
        let joints = planted::joints(frame).concat();
        let cells: Vec<String> = joints.iter().map(ToString::to_string).collect();
        format!("{}\t0\t{}", frame + 1, cells.join("\t"))
    };
    let rows: Vec<String> = (0..n_true).map(row).collect();
    let (names, rows) = (markers.join("\t\t\t"), rows.join("\n"));
    let trc = format!("x\nDataRate\tUnits\n60\tm\nFrame#\tTime\t{names}\n\n{rows}\n");
    case.write("walk.trc", trc);
    let camera = |name: &str| format!("[[camera]]\nname = {name:?}\nsource = {name:?}\n");
    let cameras = ["a", "b", "c"].map(camera).concat();
    case.write(
        "walk.toml",
        format!(
            "name = \"walk\"\ndataset = \"planted\"\nrig = \"rig.toml\"\n{cameras}\
             [truth]\ntrc = \"walk.trc\"\nworld_from_file = [\"x\", \"y\", \"z\"]\n\
             joints = \"parse14\"\nmarkers = {markers:?}\n"
        ),
    );
    case
}

/// Makes a sequence of two synthetic people, each in one frame of three cameras.
fn two_people() -> Case {
    let case = Case::new("consistency", &[1; 2], PLAIN);
    let who = ["synth", "people", "--rig", "ring:3", "--subjects", "1-2"];
    let what = ["--frames", "1", "--no-masks", "--quiet"];
    case.start(&[&who[..], &what].concat()).wait().ends(0);
    case
}

fn learn(case: &Case, more: &[&str]) -> Ended {
    let first = ["train", "consistency", "people", "--scale", "0.4"];
    case.start(&[&first, more].concat()).wait()
}

fn eval(case: &Case, more: &[&str]) -> Ended {
    let first = [
        "eval",
        "walk.toml",
        "--model",
        "model.plx",
        "--out",
        "out",
        "--no-upright",
    ];
    case.start(&[&first, more].concat()).wait()
}

fn reports(case: &Case) -> Vec<String> {
    let files = ["report.html", "report.json", "report.tex"];
    let read = |text: &str| fs::read_to_string(case.path("out").join(text)).unwrap();
    files.map(read).to_vec()
}

fn poses(case: &Case) -> PathBuf {
    case.path("out/poses/planted-walk.jsonl")
}

/// Writes the figure in three frames of each view as annotated people.
fn people(case: &Case) -> &'static str {
    let mut lines = String::new();
    for camera in planted::rig(3).cameras() {
        for frame in 0..3 {
            let at = planted::joints(frame).into_iter();
            let at = at.map(|at| camera.project(&at.into()).unwrap());
            let joints: Vec<[f64; 2]> = at.map(|at| [at.x, at.y]).collect();
            let image = format!("{}/{frame:04}.png", camera.name);
            let line = serde_json::json!({ "image": image, "joints": joints });
            lines += &(line.to_string() + "\n");
        }
    }
    case.write("people.jsonl", lines);
    "people.jsonl"
}

#[test]
fn single_pictures_get_the_same_results_as_from_model_judge() {
    let case = case(3, 3);
    let people = people(&case);
    let who = [people, "--only", "2-8", "--json"];
    let judged = case.start(&[&["judge", "model.plx"], &who[..]].concat());
    let judged = judged.wait().ends(0);
    let judged: Value = serde_json::from_str(&judged.stdout).unwrap();
    let more = ["eval", "--model", "model.plx", "--out", "out"];
    let ended = case.start(&[&more, &who[..]].concat()).wait().ends(0);
    let mut report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let got = &mut report["pictures"][0];
    assert_eq!(got["name"], "people");
    for which in ["best", "on_person"] {
        let intervals = got[which]["intervals"].take();
        got[which].as_object_mut().unwrap().remove("intervals");
        assert_eq!(got[which], judged[which], "{which}");
        let ends = intervals["pck"]["0.2"].as_array().unwrap();
        let total = judged[which]["pck"]["0.2"]["total"].as_f64().unwrap();
        assert!(ends[0].as_f64().unwrap() <= total && total <= ends[1].as_f64().unwrap());
    }
    assert_eq!(got["images"], judged["images"]);
    let [page, json, tex] = &reports(&case)[..] else {
        panic!("three reports")
    };
    assert!(page.contains("best detection on the person") && tex.contains("\\begin{tabular}"));
    assert!(json.contains("\"intervals\""));
    let found = fs::read_to_string(case.path("out/poses/people.jsonl")).unwrap();
    assert_eq!(found.lines().count(), 7);
}

#[test]
fn options_of_sequences_are_refused_for_single_pictures_and_vice_versa() {
    let case = case(1, 1);
    let people = people(&case);
    for (words, expected) in [
        (&[people, "--oracle"][..], "--oracle has no effect"),
        (&[people, "--resume"], "--resume has no effect"),
        (&[people, "walk.toml"], "cannot be evaluated in one run"),
        (
            &["walk.toml", "--only", "1"],
            "no single pictures are given",
        ),
        (&[people, people], "people is given twice"),
    ] {
        let words = [&["eval", "--model", "model.plx", "--out", "out"], words].concat();
        case.start(&words).wait().ends(2).says(expected);
    }
}

#[test]
fn a_report_has_every_version_and_is_continued_after_an_interruption() {
    let case = case(3, 3);
    let ended = eval(&case, &["--oracle", "--json", "--quiet"]).ends(0);
    let summary: Value = serde_json::from_str(&ended.stdout).unwrap();
    let versions = [
        "fmp",
        "geometry",
        "adaptive",
        "geometry+all-views",
        "adaptive+all-views",
    ];
    assert_eq!(summary["versions"], serde_json::json!(versions));
    let group = &summary["groups"][0];
    assert_eq!(
        (&group["frames"], &group["action"]),
        (&3.into(), &"walk".into())
    );
    for numbers in group["versions"].as_array().unwrap() {
        assert!(numbers["pcp3d"].is_number(), "{numbers}");
    }
    let whole = reports(&case);
    assert!(whole[0].contains("<svg") && whole[2].contains("planted"));

    eval(&case, &["--oracle"]).ends(2).says("--resume");

    // The file looks as it does after `kill -9`: it has one complete frame, and half of another.
    let kept = fs::read_to_string(poses(&case)).unwrap();
    let lines: Vec<&str> = kept.lines().collect();
    let half = &lines[2][..lines[2].len() / 2];
    fs::write(poses(&case), format!("{}\n{}\n{half}", lines[0], lines[1])).unwrap();
    eval(&case, &["--oracle", "--resume", "--threads", "1"]).ends(0);
    assert_eq!(fs::read_to_string(poses(&case)).unwrap(), kept);
    assert_eq!(reports(&case), whole);

    eval(&case, &["--oracle", "--resume", "--candidates", "2"])
        .ends(4)
        .says("other settings");
}

#[test]
fn footage_that_ends_before_the_ground_truth_is_reported() {
    let case = case(2, 4);
    let ended = eval(&case, &["--versions", "fmp"]).ends(7);
    ended.says("2 frames");
    assert!(ended.stdout.contains("planted walk"), "{}", ended.stdout);
    // The person in these pictures is smaller than models of people require.
    let height = "px tall in the frames of planted, but the filters need 150 to 250: use --scale 2";
    ended.says(height);
}

#[test]
fn impossible_evaluations_are_refused() {
    let case = case(1, 1);
    case.write("wrong.toml", "alhpa = 1\n");
    case.write("beyond.toml", "alpha = -1\n");
    for (more, code, words) in [
        (&["--versions", "adaptive"][..], 2, "--oracle"),
        (&["--versions", "fnp"], 2, "fnp"),
        (&["--size", "12"], 2, "WIDTHxHEIGHT"),
        (&["--share", "1-0.5"], 2, "the range from 1 to 0.5 is empty"),
        (&["--paper", "wrong.toml"], 3, "alhpa"),
        (&["--paper", "beyond.toml"], 3, "`paper.alpha` is -1"),
        (&["--paper", "none.toml"], 4, "none.toml"),
        (&["walk.toml"], 2, "twice"),
        (&["nowhere"], 4, "nowhere"),
        (&["a"], 4, "neither a folder of HumanEva-I"),
        (&["--size", "30x30"], 4, "30"),
    ] {
        let ended = eval(&case, more);
        let (code_found, stderr) = (ended.status.code(), &ended.stderr);
        assert_eq!(code_found, Some(code), "{more:?}: {stderr}");
        assert!(stderr.contains(words), "{more:?}: {stderr}");
    }
}

#[test]
fn learned_consistency_does_not_depend_on_the_number_of_threads() {
    let case = two_people();
    let learned = ["1", "3"].map(|threads| {
        let out = format!("{threads}.consistency");
        learn(
            &case,
            &["--out", &out, "--tries", "0", "--threads", threads],
        )
        .ends(0);
        fs::read(case.path(&out)).unwrap()
    });
    assert!(learned[0] == learned[1]);
}

#[test]
fn an_unusable_consistency_file_is_refused() {
    let case = case(1, 1);
    case.write("wrong.consistency", "{\"format\": \"x\", \"version\": 1}");
    case.write("learned.toml", "tau = \"learned\"\n");
    for (more, code, words) in [
        (
            &["--consistency", "none.consistency"][..],
            4,
            "none.consistency",
        ),
        (
            &["--consistency", "wrong.consistency"],
            4,
            "parallax-consistency",
        ),
        (&["--paper", "learned.toml"], 3, "--consistency"),
    ] {
        let ended = eval(&case, more);
        let (code_found, stderr) = (ended.status.code(), &ended.stderr);
        assert_eq!(code_found, Some(code), "{more:?}: {stderr}");
        assert!(stderr.contains(words), "{more:?}: {stderr}");
    }
    let out = [
        "train",
        "consistency",
        "walk.toml",
        "--out",
        "c.consistency",
    ];
    case.start(&out).wait().ends(2).says("no subject is left");
    case.start(&[&out[..], &["--hold-out", "eve"]].concat())
        .wait()
        .ends(2)
        .says("no subject \"eve\"");
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use super::*;

    #[test]
    #[ignore = "takes long"]
    fn consistency_between_views_is_learned_and_used() {
        let case = two_people();
        let out = ["--out", "a.consistency", "--rig", "hall", "--tries", "1"];
        let ended = learn(&case, &[&out[..], &["--json", "--quiet"]].concat()).ends(0);
        let said: Value = serde_json::from_str(&ended.stdout).unwrap();
        assert_eq!(said["learned_from"]["views"], 3, "{said}");
        assert_eq!(said["learned_from"]["held_out"], 1, "{said}");
        assert!(said["surface"].as_array().unwrap().len() > 20, "{said}");

        case.write(
            "hall.toml",
            "consistency = { file = \"a.consistency\", rig = \"hall\" }\n",
        );
        let used = ["eval", "people", "--scale", "0.4", "--out", "out", "--json"];
        let versions = ["--versions", "appearance", "--paper", "hall.toml"];
        case.start(&[&used[..], &versions].concat()).wait().ends(0);
    }
}
