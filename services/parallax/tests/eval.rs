//! `parallax eval`, and `parallax train consistency` before it, as a user starts them: what they leave behind, go on with, and refuse.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use std::fs;
use std::path::PathBuf;

use common::{Case, Ended, PLAIN, planted};
use serde_json::Value;

/// Three views of a planted figure that walks, described as a sequence of `n_frames` whose truth is known.
fn case(n_frames: usize, n_true: usize) -> Case {
    let case = Case::new("eval", &[n_frames; 3], PLAIN);
    let markers: Vec<String> = (0..14).map(|it| format!("M{it}")).collect();
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

/// The same walk by two people.
fn two_people(case: &Case) {
    let walk = fs::read_to_string(case.path("walk.toml")).unwrap();
    for subject in ["ann", "bob"] {
        let named = format!("subject = {subject:?}\n{walk}");
        let named = named.replace("name = \"walk\"", &format!("name = \"{subject} walk\""));
        case.write(&format!("{subject}.toml"), named);
    }
}

fn learn(case: &Case, more: &[&str]) -> Ended {
    let model = ["--model", "model.plx", "--no-upright", "--tries", "1"];
    let first = ["train", "consistency", "ann.toml", "bob.toml"];
    case.start(&[&first, &model[..], more].concat()).wait()
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
    let read = |it: &str| fs::read_to_string(case.path("out").join(it)).unwrap();
    files.map(read).to_vec()
}

fn poses(case: &Case) -> PathBuf {
    case.path("out/poses/planted-walk.jsonl")
}

#[test]
fn a_report_holds_every_version_and_goes_on_where_it_was_cut_off() {
    let case = case(3, 3);
    let ended = eval(&case, &["--oracle", "--json", "--quiet"]);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
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

    let again = eval(&case, &["--oracle"]);
    assert_eq!(again.status.code(), Some(2), "{}", again.stderr);
    assert!(again.stderr.contains("--resume"), "{}", again.stderr);

    // As kill -9 leaves it: one whole frame, and half of another.
    let kept = fs::read_to_string(poses(&case)).unwrap();
    let lines: Vec<&str> = kept.lines().collect();
    let half = &lines[2][..lines[2].len() / 2];
    fs::write(poses(&case), format!("{}\n{}\n{half}", lines[0], lines[1])).unwrap();
    let resumed = eval(&case, &["--oracle", "--resume", "--threads", "1"]);
    assert_eq!(resumed.status.code(), Some(0), "{}", resumed.stderr);
    assert_eq!(fs::read_to_string(poses(&case)).unwrap(), kept);
    assert_eq!(reports(&case), whole);

    let other = eval(&case, &["--oracle", "--resume", "--candidates", "2"]);
    assert_eq!(other.status.code(), Some(4), "{}", other.stderr);
    assert!(other.stderr.contains("other settings"), "{}", other.stderr);
}

#[test]
fn footage_that_ends_before_the_truth_is_told() {
    let case = case(2, 4);
    let ended = eval(&case, &["--versions", "fmp"]);
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    assert!(ended.stderr.contains("2 frames"), "{}", ended.stderr);
    assert!(ended.stdout.contains("planted walk"), "{}", ended.stdout);
}

#[test]
fn what_cannot_be_done_is_refused() {
    let case = case(1, 1);
    case.write("wrong.toml", "alhpa = 1\n");
    for (more, code, words) in [
        (&["--versions", "adaptive"][..], 2, "--oracle"),
        (&["--versions", "fnp"], 2, "fnp"),
        (&["--size", "12"], 2, "WIDTHxHEIGHT"),
        (&["--share", "1-0.5"], 2, "nothing lies between"),
        (&["--fuse", "wrong.toml"], 3, "alhpa"),
        (&["--fuse", "none.toml"], 4, "none.toml"),
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
fn what_views_have_in_common_is_learned_and_used() {
    let case = case(2, 2);
    two_people(&case);
    let out = [
        "--out",
        "a.consistency",
        "--rig",
        "hall",
        "--json",
        "--quiet",
    ];
    let ended = learn(&case, &out);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let said: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(said["learned_from"]["views"], 6, "{said}");
    assert_eq!(said["learned_from"]["held_out"], 1, "{said}");
    assert!(said["surface"].as_array().unwrap().len() > 20, "{said}");

    let again = learn(
        &case,
        &["--out", "b.consistency", "--rig", "hall", "--threads", "1"],
    );
    assert_eq!(again.status.code(), Some(0), "{}", again.stderr);
    assert!(again.stdout.contains("<- chosen"), "{}", again.stdout);
    let [a, b] = ["a", "b"].map(|it| fs::read(case.path(&format!("{it}.consistency"))).unwrap());
    assert!(a == b, "the file does not depend on the number of threads");

    case.write(
        "hall.toml",
        "consistency = \"a.consistency\"\nconsistency_rig = \"hall\"\n",
    );
    let used = eval(&case, &["--fuse", "hall.toml", "--json"]);
    assert_eq!(used.status.code(), Some(0), "{}", used.stderr);
    let summary: Value = serde_json::from_str(&used.stdout).unwrap();
    let versions = summary["versions"].as_array().unwrap();
    assert!(versions.contains(&"appearance".into()), "{versions:?}");
}

#[test]
fn a_consistency_file_that_cannot_be_used_is_refused() {
    let case = case(1, 1);
    two_people(&case);
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
        (&["--fuse", "learned.toml"], 3, "--consistency"),
    ] {
        let ended = eval(&case, more);
        let (code_found, stderr) = (ended.status.code(), &ended.stderr);
        assert_eq!(code_found, Some(code), "{more:?}: {stderr}");
        assert!(stderr.contains(words), "{more:?}: {stderr}");
    }
    let ended = learn(&case, &["--out", "c.consistency", "--hold-out", "eve"]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("only ann, bob"), "{}", ended.stderr);
}
