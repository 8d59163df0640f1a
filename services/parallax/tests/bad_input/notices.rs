//! Tests of the notices that are shown before a run begins, and of the reported origin of data.

use std::fs;
use std::path::Path;

use crate::common::{Case, PLAIN};

#[test]
fn comments_of_included_files_name_the_origin_of_their_data() {
    // The files are in a separate folder, as in a fresh clone.
    let case = Case::new("oops-clone", &[2; 2], PLAIN);
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs");
    fs::create_dir(case.path("configs")).unwrap();
    for (name, words) in [
        (
            "pose2sim-balancing.toml",
            ["Pose2Sim", "../shared beside the clone"],
        ),
        (
            "humaneva-still-paper.toml",
            ["HumanEva-I", "../shared beside the clone"],
        ),
        (
            "umpm-still-paper.toml",
            ["UMPM", "../shared beside the clone"],
        ),
    ] {
        fs::copy(configs.join(name), case.path("configs").join(name)).unwrap();
        let ended = case.start(&["run", &format!("configs/{name}"), "--dry-run"]).wait();
        assert_eq!(ended.status.code(), Some(4), "{}", ended.stderr);
        let hint = "comments in this file may state the origin of its data";
        assert!(ended.stderr.contains(hint), "{name}: {}", ended.stderr);
        let text = fs::read_to_string(configs.join(name)).unwrap();
        for word in words {
            assert!(text.contains(word), "{name} lacks {word}");
        }
    }
}

#[test]
fn included_files_are_found_from_any_program_location() {
    let case = Case::new("oops-ships", &[2; 2], PLAIN);
    case.edit(
        "deployment.toml",
        "model = \"model.plx\"\nbodies = false\n",
        "",
    );
    case.edit(
        "deployment.toml",
        "workers = 2",
        "workers = 2\nconsistency = \"shipped\"\ntau = \"learned\"\nerrors = \"shipped\"",
    );
    let check = ["config", "check", "deployment.toml"];
    case.start(&check).wait().ends(0);
    // A path is used as a path, even if it looks like a name.
    for (from, to) in [
        ("errors = \"shipped\"", "errors = \"./shipped\""),
        ("\"./shipped\"", "\"a/shipped\""),
    ] {
        case.edit("deployment.toml", from, to);
        case.start(&["config", "check", "deployment.toml"])
            .wait()
            .ends(4)
            .says("/shipped: No such file");
    }
}

#[test]
fn padding_is_reported_with_a_size_that_avoids_it() {
    let case = Case::new("oops-pad", &[2; 2], PLAIN);
    let said = |size: &str| {
        let set = format!("capture.size={size}");
        let ended = case
            .start(&["config", "check", "deployment.toml", "--set", &set])
            .wait()
            .ends(0);
        ended.stderr
    };
    // The pictures have 96x128 pixels.
    let landscape = said("[160, 120]");
    for words in [
        "44 % of every 160x120 frame of a, b is padding",
        "capture.size = [90, 120]",
        "96x128",
    ] {
        assert!(landscape.contains(words), "{words}: {landscape}");
    }
    assert!(!said("[90, 120]").contains("padding"));
}

#[test]
fn the_announced_size_of_a_recording_is_correct() {
    let case = Case::new("oops-room", &[4; 2], PLAIN);
    let ended = case.start(&["record", "deployment.toml", "--out", "run.mcap"]).wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let line = ended.stderr.lines().find(|line| line.starts_with("recording ")).unwrap();
    ended.says("--without evidence: ");
    assert!(line.contains(" for all 4 frames; "), "{line}");
    // The predicted size is not smaller than the actual size, and not many times larger.
    let number = |before: &str| -> f64 {
        let at = line.find(before).unwrap() + before.len();
        let mut words = line[at..].split(' ');
        let number: f64 = words.next().unwrap().parse().unwrap();
        let unit = words.next().unwrap();
        number * if unit.starts_with("MB") { 1e6 } else { 1e3 }
    };
    let said = number("up to ") * 4.0;
    let took = fs::metadata(case.path("run.mcap")).unwrap().len() as f64;
    // Heartbeats, schemas and settings need some hundred kilobytes.
    assert!(
        took < said + 1e6 && said < 4.0 * took,
        "said {said}, took {took}: {line}"
    );
}
