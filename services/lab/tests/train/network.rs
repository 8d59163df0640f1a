//! `parallax-lab train network-people` and `parallax-lab train network`.

use serde_json::Value;

use super::{Drawn, assert_ended};

#[test]
fn people_are_prepared_and_one_block_in_twelve_is_held_out() {
    let drawn = Drawn::new(240);
    let words = ["train", "network-people", "people.jsonl", "--sides", "seen"];
    let ended = drawn.start(&[&words[..], &["--json", "--out", "people.bin"]].concat()).wait();
    assert_ended(&ended, 0, &[]);
    let report: Value = serde_json::from_str(ended.stdout.lines().last().unwrap()).unwrap();
    assert_eq!([&report["learnt"], &report["kept_apart"]], [220, 20]);
    let picture = 3 * 256 * 256;
    assert!(drawn.model("people.bin").len() > 240 * picture);
}

#[test]
fn missing_people_are_named_in_the_error_and_settings_can_be_printed() {
    let drawn = Drawn::new(1);
    let words = ["train", "network", "people.bin", "--out", "n.onnx"];
    let ended = drawn.start(&words).wait();
    assert_ended(&ended, 4, &["people.bin"]);
    let ended = drawn.start(&["train", "network", "--print-settings"]).wait();
    assert_ended(&ended, 0, &[]);
    assert!(ended.stdout.contains("[shape]"), "{}", ended.stdout);
}
