//! Evaluation of the keypoints of networks on sequences, with networks that are small enough to be defined here.

use crate::common;

use common::networks::{DETECTOR, detector_of, sides};
use common::{Case, Ended, PLAIN};
use inference::onnx::{Attribute, Network};
use serde_json::Value;

const CARD: &str = r#"
format = "parallax-keypoint-network"
version = 1
name = "Fourteen mixtures of colours"
[input]
width = 48
height = 64
scale = 0.00392156862745098
[output]
codec = "heat-map"
[keypoints]
set = "lsp-14"
"#;

/// Returns a network with fourteen outputs, which are mixtures of the mean red, green and blue in blocks of four by four pixels.
fn network() -> Network {
    let mut net = Network::default();
    net.inputs.push(("picture".to_owned(), sides([1, 3, 64, 48])));
    net.outputs.push(("maps".to_owned(), sides([1, 14, 16, 12])));
    let weights = (0..14 * 3).map(|i| (i * 5 % 7) as f32 / 7.0 - 0.3).collect();
    net.floats("weights", &[14, 3, 1, 1], weights);
    let four = || Attribute::Ints(vec![4, 4]);
    let attributes = vec![("kernel_shape", four()), ("strides", four())];
    net.node("AveragePool", &["picture"], "means", attributes);
    let one = vec![("kernel_shape", Attribute::Ints(vec![1, 1]))];
    net.node("Conv", &["means", "weights"], "maps", one);
    net
}

/// Returns a detector that finds one box in every picture. Its score is `score` plus a ten-thousandth of the mean colour.
fn detector(score: f32) -> Network {
    detector_of([20.0, 4.0, 44.0, 50.0], score)
}

/// Makes three views of a synthetic person, the networks and their cards.
fn case(name: &str, score: f32) -> Case {
    let case = Case::new(name, &[1, 1], PLAIN);
    case.start(&["synth", "people", "--rig", "ring:3", "--frames", "2"])
        .wait()
        .ends(0);
    case.write("net.onnx", network().file());
    case.write("net.toml", CARD);
    case.write("det.onnx", detector(score).file());
    case.write("det.toml", DETECTOR);
    case
}

fn eval(case: &Case, more: &[&str]) -> Ended {
    let always = [
        "eval",
        "people",
        "--out",
        "out",
        "--network-evidence",
        "net.onnx",
        "--detector",
        "det.onnx",
    ];
    case.start(&[&always[..], more].concat()).wait()
}

#[test]
fn every_stress_test_has_a_row_for_every_solver() {
    let case = case("eval-networks", 0.9);
    let ended = eval(&case, &["--stress", "all", "--json"]).ends(0);
    let rows: Vec<Value> = serde_json::from_str(ended.stdout.trim()).unwrap();
    assert_eq!(rows.len(), 7 * 4 + 1, "and one of what run gives");
    assert_eq!(rows[28]["method"], "as run");
    for row in &rows {
        assert_eq!(row["n_frames"], 2, "{row}");
        let [from, to] = [0, 1].map(|i| row["limbs_mm_interval"][i].as_f64().unwrap());
        let mean = row["limbs_mm"].as_f64().unwrap();
        assert!((0.0..=2000.0).contains(&mean), "{row}");
        assert!(from <= mean + 1e-9 && mean <= to + 1e-9, "{row}");
    }
    let file = std::fs::read_to_string(case.path("out/evidence.json")).unwrap();
    assert_eq!(serde_json::from_str::<Vec<Value>>(&file).unwrap(), rows);
    let text = std::fs::read_to_string(case.path("out/evidence.txt")).unwrap();
    for name in ["covered:2", "cameras dropped", "maps and bones"] {
        assert!(text.contains(name), "{text}");
    }
    // A repetition gives the same numbers.
    let again = eval(&case, &["--stress", "covered:1,exchanged", "--json"]);
    let again: Vec<Value> = serde_json::from_str(again.stdout.trim()).unwrap();
    assert_eq!(again[..4], rows[4..8]);
    assert_eq!(again[4..], rows[24..28]);
}

#[test]
fn if_the_detector_finds_nobody_every_joint_counts_as_not_found() {
    let case = case("eval-nobody", 0.1);
    let ended = eval(&case, &["--json"]).ends(0);
    let rows: Vec<Value> = serde_json::from_str(ended.stdout.trim()).unwrap();
    assert!(
        rows.iter().all(|row| row["pcp3d"] == 0.0 && row["limbs_mm"] == 2000.0),
        "{rows:?}"
    );
}

#[test]
fn inputs_that_cannot_be_judged_are_refused() {
    let case = case("eval-networks-refused", 0.9);
    let refused = |more: &[&str], code: i32, words: &str| {
        let ended = eval(&case, more);
        assert_eq!(
            ended.status.code(),
            Some(code),
            "{more:?}: {}",
            ended.stderr
        );
        assert!(ended.stderr.contains(words), "{more:?}: {}", ended.stderr);
    };
    refused(
        &["--stress", "dirty"],
        2,
        "\"dirty\" is not one of clean, covered:N",
    );
    // Options that only apply to versions of the method are refused, not ignored.
    refused(&["--versions", "geometry"], 2, "--versions");
    refused(&["--resume"], 2, "--resume");
    refused(&["--detector-card", "none.toml"], 4, "none.toml");
    refused(&["--detector-card", "net.toml"], 4, "net.toml");
    refused(&["--card", "det.toml"], 4, "det.toml");
    let other = DETECTOR.replace("width = 64", "width = 96");
    case.write("wide.toml", other);
    refused(
        &["--detector-card", "wide.toml"],
        4,
        "[1, 3, 64, 64], but the card states [1, 3, 64, 96]",
    );
    case.start(&["eval", "people", "--out", "out", "--stress", "all"])
        .wait()
        .ends(2);
}
