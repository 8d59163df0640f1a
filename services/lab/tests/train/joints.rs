//! `parallax-lab train joints` and the commands that use its file. Knees are marked lower than in the training data of the model.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;

use super::{Drawn, assert_ended};
use crate::common::Ended;

/// The knees of a figure, and the hips above them.
const KNEES: [[usize; 2]; 2] = [[1, 2], [4, 3]];
/// Distance by which the mark is below the knee, as a fraction of the length of the thigh.
const BEYOND: f64 = 0.25;

impl Drawn {
    /// Trains a model. Draws people from whom joints are learned, and other people. The knees of all of them are marked too low.
    fn with_low_knees() -> Self {
        let drawn = Self::new(14);
        assert_ended(&drawn.train("m.fmp", &[]).wait(), 0, &[]);
        drawn.people("more", 30, 5);
        for name in ["more", "others"] {
            let text = fs::read_to_string(drawn.path(&format!("{name}.jsonl"))).unwrap();
            let mut low = String::new();
            for line in text.lines() {
                let mut line: Value = serde_json::from_str(line).unwrap();
                for [knee, hip] in KNEES {
                    let joints = &line["joints"];
                    let lowered = [0, 1].map(|axis| {
                        let at = |joint: usize| joints[joint][axis].as_f64().unwrap();
                        at(knee) + BEYOND * (at(knee) - at(hip))
                    });
                    line["joints"][knee] = lowered.to_vec().into();
                }
                writeln!(low, "{line}").unwrap();
            }
            drawn.write(&format!("{name}-low.jsonl"), low);
        }
        drawn
    }

    fn learn_joints(&self, out: &str, more: &[&str]) -> Ended {
        let words = ["train", "joints", "m.fmp", "more-low.jsonl", "--out", out];
        self.start(&[&words[..], more].concat()).wait()
    }

    /// Returns the mean offset of a joint along its bone and the positions of the joints, as printed by `judge`.
    fn offset(&self, joint: &str, joint_map: &str) -> (f64, Value) {
        let words = ["judge", "m.fmp", "others-low.jsonl", "--json"];
        let more = ["--offsets", "--joint-map", joint_map];
        let ended = self.start(&[&words[..], &more].concat()).wait();
        assert_ended(&ended, 0, &[]);
        let report: Value = serde_json::from_str(&ended.stdout).unwrap();
        let rows = report["offsets"].as_array().unwrap();
        let row = rows.iter().find(|row| row["joint"] == joint).unwrap();
        let along = row["along"].as_f64().unwrap();
        let ends = [0, 1].map(|i| row["along_interval"][i].as_f64().unwrap());
        assert!(ends[0] <= along && along <= ends[1], "{row}");
        (along, report["joints"].clone())
    }

    /// Returns the right knee that `detect` finds.
    fn knee(&self, joint_map: &str) -> Value {
        let words = ["detect", "others/0.png", "--model", "m.fmp", "--json"];
        let more = ["--threshold", "-9", "--joint-map", joint_map];
        let ended = self.start(&[&words[..], &more].concat()).wait();
        assert_ended(&ended, 0, &[]);
        let line: Value = serde_json::from_str(&ended.stdout).unwrap();
        line["detections"][0]["joints"]["right knee"].clone()
    }
}

#[test]
fn a_learned_joint_map_moves_the_knees_to_where_they_were_marked() {
    let drawn = Drawn::with_low_knees();
    let learned = drawn.learn_joints("one.joints", &["--threads", "1", "--json"]);
    assert_ended(&learned, 0, &[]);
    let summary: Value = serde_json::from_str(learned.stdout.lines().last().unwrap()).unwrap();
    let set = &summary["learned"]["sets"][0];
    assert_eq!(set["people"], 30, "{summary}");
    let error = |text: &str| set[text].as_f64().unwrap();
    assert!(error("error_after") < error("error_before"), "{summary}");

    let (before, plain) = drawn.offset("knee", "none");
    let (after, with_file) = drawn.offset("knee", "one.joints");
    assert!(
        before < -3.0 && after.abs() < 0.4 * before.abs(),
        "{before} {after}"
    );
    assert_eq!(plain, "the centres of parts");
    assert_eq!(with_file, "as learned (one.joints)");
    let (shipped, of_other) = drawn.offset("knee", "shipped");
    assert_eq!((shipped, &of_other), (before, &plain), "of another model");

    let again = drawn.learn_joints("two.joints", &["--threads", "2"]);
    assert!(again.stdout.contains("<- chosen"), "{}", again.stdout);
    assert!(drawn.model("one.joints") == drawn.model("two.joints"));

    assert_eq!(drawn.knee("shipped"), drawn.knee("none"));
    let [low, high] = ["one.joints", "none"].map(|name| drawn.knee(name)[1].as_f64().unwrap());
    assert!(low > high + 1.0, "{low} {high}");
}

#[test]
fn a_joint_map_of_another_model_and_too_few_people_are_refused() {
    let drawn = Drawn::with_low_knees();
    let few = drawn.learn_joints("few.joints", &["--only", "1-19"]);
    assert_ended(&few, 4, &["people were found, expected 20"]);
    assert!(!drawn.path("few.joints").exists());

    assert_ended(&drawn.learn_joints("m.joints", &[]), 0, &[]);
    let text = fs::read_to_string(drawn.path("m.joints")).unwrap();
    let (head, _) = text.split_once("\",\n\"learned\"").unwrap();
    let model = &head[head.len() - 16..];
    drawn.write("other.joints", text.replace(model, "0123456789abcdef"));
    drawn.write("broken.joints", &text[..text.len() / 2]);
    for (file, said) in [
        ("other.joints", "was learned with the model"),
        ("broken.joints", "broken.joints"),
        ("absent.joints", "train joints"),
    ] {
        for words in [
            &["detect", "others", "--model", "m.fmp"][..],
            &["judge", "m.fmp", "others-low.jsonl"],
        ] {
            let ended = drawn.start(&[words, &["--joint-map", file]].concat());
            assert_ended(&ended.wait(), 4, &[said]);
        }
    }
}
