//! `parallax-lab train finder-pictures`, `parallax-lab train finder`, and `parallax-lab judge` on the resulting detector.

use serde_json::Value;

use super::{Drawn, assert_ended};

#[test]
fn a_detector_is_trained_on_prepared_pictures_and_judged_on_held_out_ones() {
    let drawn = Drawn::new(240);
    let words = ["train", "finder-pictures", "people.jsonl", "--json"];
    let ended = drawn.start(&[&words[..], &["--out", "pictures.bin"]].concat()).wait();
    assert_ended(&ended, 0, &[]);
    let report: Value = serde_json::from_str(ended.stdout.lines().last().unwrap()).unwrap();
    assert_eq!([&report["learnt"], &report["kept_apart"]], [220, 20]);

    let settings =
        "batch = 2\nsmall = 0.0\n[shape]\nside = 64\nstem = 8\nchannels = [8, 8, 8, 8]\n";
    drawn.write("finder.toml", settings);
    let words = [
        "train",
        "finder",
        "pictures.bin",
        "--settings",
        "finder.toml",
    ];
    let ended = drawn
        .start(&[&words[..], &["--steps", "3", "--json", "--out", "n.onnx"]].concat())
        .wait();
    assert_ended(&ended, 0, &[]);
    let pass: Value = serde_json::from_str(ended.stdout.lines().last().unwrap()).unwrap();
    assert_eq!([&pass["step"], &pass["score"]["pictures"]], [3, 20]);

    let ended = drawn.start(&["judge", "n.onnx", "pictures.bin", "--json"]).wait();
    assert_ended(&ended, 0, &[]);
    let judged: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(judged["people"], 20, "everybody has a box");
}
