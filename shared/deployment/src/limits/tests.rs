//! Tests every numeric key of a deployment with values that are not allowed, and the message for each.

mod others;

use std::path::Path;

use crate::{AnyMachine, ConfigError, Loaded, keys};
use others::OTHERS;

const SHORT: &str = "name = 'two'\nrig = 'rig.toml'\noutput = 'out'\n\
    [[camera]]\nname = 'a'\nsource = 'a.mp4'\n[[camera]]\nname = 'b'\nsource = 'b.mp4'\n";

fn read(set: &str) -> Result<Loaded, ConfigError> {
    let file = Path::new("deployment.toml");
    let mut set = vec![set.to_owned()];
    if set[0].starts_with("paper.") {
        set.push("method=paper".to_owned());
    }
    Loaded::parse(SHORT, file, &set, &AnyMachine)
}

/// A key, its refused values with parts of their messages, and its accepted values.
type Row = (
    &'static str,
    &'static [(&'static str, &'static str)],
    &'static [&'static str],
);

const ROWS: &[Row] = &[
    (
        "up",
        &[
            ("[0, 0, 0]", "expected a direction"),
            ("[nan, 0, 1]", "[NaN, 0, 1]"),
            ("[1e200, 0, 0]", "a direction"),
        ],
        &["[0, -1, 0]"],
    ),
    (
        "capture.size",
        &[
            ("[0, 480]", "is 0, expected 1 to 16384"),
            ("[480, 99999]", "is 99999"),
            ("[-1, 2]", "expected a whole number"),
        ],
        &["[272, 480]"],
    ),
    (
        "capture.scale",
        &[
            ("0", "is 0"),
            ("-1.0", "is -1"),
            ("nan", "is NaN"),
            ("inf", "is inf"),
            ("1e-300", "expected 0.001 to 8"),
            ("9.0", "is 9"),
        ],
        &["0.25", "8.0"],
    ),
    (
        "capture.frame_rate_hz",
        &[
            ("0", "is 0"),
            ("-30", "is -30"),
            ("nan", "is NaN"),
            ("1e-308", "expected 0.001 to 100000"),
            ("1e308", "expected 0.001 to 100000"),
        ],
        &["29.97", "240"],
    ),
    (
        "capture.start_frame",
        &[
            ("-1", "expected a whole number"),
            ("9223372036854775807", "expected 0 to"),
        ],
        &["0", "5000"],
    ),
    (
        "capture.frame_step",
        &[("0", "expected"), ("9223372036854775807", "expected 1 to")],
        &["1", "30"],
    ),
    (
        "capture.n_frames",
        &[
            ("0", "is 0, expected 1 to"),
            ("9223372036854775807", "expected 1 to"),
        ],
        &["1"],
    ),
    (
        "capture.frozen_after",
        &[
            ("-1", "expected a whole number"),
            ("99999999999", "expected a whole number"),
        ],
        &["0", "10"],
    ),
    (
        "paper.candidates",
        &[("0", "is 0, expected 1 to"), ("100000", "is 100000")],
        &["1"],
    ),
    (
        "network.find_every",
        &[("0", "is 0, expected 1 to 1000000"), ("-1", "find_every")],
        &["1", "30"],
    ),
    (
        "network.least_heat",
        &[("-0.1", "is -0.1"), ("1.1", "expected 0 to 1")],
        &["0.0", "0.5"],
    ),
    (
        "network.looks",
        &[("0", "is 0, expected 0.1 to 1000"), ("-1", "is -1")],
        &["0.5", "2"],
    ),
    (
        "network.people",
        &[("0", "is 0, expected 1 to 8"), ("9", "is 9")],
        &["1"],
    ),
    (
        "runtime.threads",
        &[("0", "is 0, expected 1 to 256"), ("257", "is 257")],
        &["1"],
    ),
    (
        "paper.alpha",
        &[
            ("-1", "is -1"),
            ("nan", "is NaN"),
            ("1e308", "expected 0 to 1000000"),
        ],
        &["0.0", "0.002"],
    ),
    (
        "paper.beta",
        &[
            ("-1", "is -1"),
            ("inf", "is inf"),
            ("1e308", "expected 0 to 1000000"),
        ],
        &["0.03"],
    ),
    (
        "paper.tau",
        &[
            ("[-1.0]", "is -1"),
            ("[nan]", "is NaN"),
            ("[1e30]", "expected 0 to 1000000"),
        ],
        &["[5.0, 6.0]"],
    ),
    (
        "paper.workers",
        &[("0", "is 0, expected 1 to 16"), ("17", "is 17")],
        &["2"],
    ),
    (
        "results.overlay_every",
        &[("-1", "expected a whole number")],
        &["0", "10"],
    ),
    (
        "supervise.deadline_ms",
        &[
            ("0", "is 0, expected 1 to 3600000"),
            ("9223372036854775807", "expected 1 to 3600000"),
        ],
        &["200"],
    ),
    (
        "supervise.hang_limit_s",
        &[
            ("0", "is 0, expected 1 to 86400"),
            ("9223372036854775807", "expected 1 to 86400"),
        ],
        &["3"],
    ),
    (
        "supervise.missed_beats",
        &[("0", "is 0, expected 1 to 1000000")],
        &["3"],
    ),
    (
        "supervise.max_restarts",
        &[("4294967295", "expected 0 to 1000000")],
        &["0"],
    ),
    (
        "supervise.latency_budget_ms",
        &[
            ("0", "is 0"),
            ("nan", "is NaN"),
            ("1e308", "expected 0.001 to"),
        ],
        &["0.001", "150"],
    ),
    (
        "runtime.cores",
        &[
            ("{ pose = [99999999999] }", "is 99999999999"),
            ("{ pose = [] }", "empty"),
        ],
        &["{ pose = [0] }"],
    ),
    (
        "runtime.priority",
        &[
            ("{ pose = 0 }", "is 0, expected 1 to 99"),
            ("{ pose = 100 }", "is 100"),
        ],
        &["{ pose = 10 }"],
    ),
];

#[test]
fn every_numeric_key_states_its_range() {
    let mut wrong = Vec::new();
    for (key, refused, taken) in ROWS {
        for (value, words) in *refused {
            let said = read(&format!("{key}={value}"))
                .map_or_else(|error| error.to_string(), |_| "taken".to_owned());
            if !said.contains(words) {
                wrong.push(format!("{key} = {value}, expected {words:?}: {said}"));
            }
        }
        for value in *taken {
            if let Err(error) = read(&format!("{key}={value}")) {
                wrong.push(format!("{key} = {value} is refused: {error}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let keys = keys();
    for key in keys.iter().map(|key| key.name.as_str()) {
        // Keys of hosts are tested in `hosts/tests.rs`.
        let of_hosts = key == "host" || key.starts_with("link.");
        let is_asked = of_hosts || ROWS.iter().any(|row| row.0 == key) || OTHERS.contains(&key);
        assert!(is_asked, "{key} stands in no table: what may it be?");
    }
}

#[test]
fn implausible_values_are_named_with_their_number() {
    let doubts = |set: &str| read(set).unwrap().deployment.doubts(Some(4));
    assert_eq!(doubts("capture.mode=lossless"), Vec::<String>::new());
    for (set, words) in [
        ("supervise.deadline_ms=5", "`supervise.deadline_ms` is 5"),
        ("supervise.hang_limit_s=2", "`supervise.hang_limit_s` is 2"),
        (
            "capture.frame_rate_hz=0.01",
            "`capture.frame_rate_hz` is 0.01",
        ),
        (
            "runtime.priority={ pose = 99 }",
            "`runtime.priority` of pose is 99",
        ),
    ] {
        let said = doubts(set);
        assert!(
            matches!(&said[..], [one] if one.contains(words)),
            "{set}: {said:?}"
        );
    }
}

#[test]
fn a_camera_needs_footage_or_keypoints_with_known_names() {
    let of_camera = |lines: &str| {
        let text = format!("{SHORT}[[camera]]\nname = 'c'\n{lines}\n");
        let read = Loaded::parse(&text, Path::new("/room/deployment.toml"), &[], &AnyMachine);
        read.map_err(|error| error.to_string())
    };
    for (lines, words) in [
        ("", "`camera.source` is missing for camera \"c\""),
        ("source = ''", "`camera.source` is missing for camera \"c\""),
        (
            "source = 'c.mp4'\nkeypoint_names = 'coco-17'",
            "expected no value, because this camera has no `keypoints`",
        ),
        (
            "keypoints = 'c'\nkeypoint_names = 'coco17'",
            "`camera.keypoint_names` is \"coco17\", expected one of coco-17, halpe-26",
        ),
        ("keypoints = 3", "keypoints"),
    ] {
        let refused = of_camera(lines).unwrap_err();
        assert!(refused.contains(words), "{lines}: {refused}");
    }
    let taken = of_camera("keypoints = 'c_json/'\nkeypoint_names = 'body-25'").unwrap();
    let camera = &taken.deployment.cameras[2];
    assert_eq!(camera.source, "");
    assert_eq!(
        camera.keypoints.as_deref(),
        Some(Path::new("/room/c_json/"))
    );
    assert_eq!(camera.keypoint_names.as_deref(), Some("body-25"));
    let again = Loaded::again(&taken.deployment, &[], |_| None, &AnyMachine).unwrap();
    assert_eq!(again.deployment, taken.deployment);
}
