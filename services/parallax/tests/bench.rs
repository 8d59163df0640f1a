//! Tests of benchmarks with real processes. They check the reports and the exit codes, and that pixels are never copied.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use std::fs;

use common::{Case, Ended, PLAIN};
use messages::{PairPose, Sightings};
use serde_json::{Value, json};

/// Runs a benchmark in the folder of a case, under the name of the case.
fn bench(case: &Case, words: &[&str]) -> (Ended, Value) {
    let shared = ["--name", &case.name, "--json"];
    let ended = case.start(&[&["bench"], words, &shared].concat()).wait();
    case.assert_nothing_left();
    let report = serde_json::from_str(&ended.stdout).unwrap_or(Value::Null);
    (ended, report)
}

/// Series are short, because their speed is not tested.
const SERIES: [&str; 6] = [
    "transport",
    "--messages",
    "60",
    "--interval-us",
    "2000",
    "--bytes=64,115584",
];

#[test]
fn two_processes_read_every_message_at_the_same_place_without_copying() {
    let case = Case::new("transport", &[1; 2], "");
    let more = ["--record", "record.md"];
    let (ended, report) = bench(&case, &[&SERIES[..], &more].concat());
    assert_eq!(ended.status.code(), Some(0), "{}\n{report:#}", ended.stderr);
    let rows = report["numbers"].as_array().unwrap();
    let kinds: Vec<(&Value, &Value)> =
        rows.iter().map(|row| (&row["receiver"], &row["bytes"])).collect();
    let expected = [
        (&json!("event"), &json!(64)),
        (&json!("event"), &json!(115_584)),
        (&json!("poll"), &json!(64)),
        (&json!("poll"), &json!(115_584)),
    ];
    assert_eq!(kinds, expected);
    for row in rows {
        let count = |value: &Value| value.as_u64().unwrap();
        assert_eq!(row["copied_bytes"], 0, "{row:#}");
        assert_eq!(row["broken"], 0, "{row:#}");
        let places = &row["places"];
        assert!(count(&places["compared"]) > 0, "{row:#}");
        assert_eq!(places["compared"], places["same"], "{row:#}");
        assert_eq!(count(&row["received"]) + count(&row["lost"]), 60, "{row:#}");
        assert_eq!(row["hop_us"]["n"], row["received"]);
        assert!(row["hop_us"]["p50"].as_f64() > Some(0.0), "{row:#}");
    }
    let record = fs::read_to_string(case.path("record.md")).unwrap();
    for words in [
        "transport",
        "commit ",
        " cores, Linux ",
        "load average",
        "messages 60",
        "polling",
    ] {
        assert!(record.contains(words), "{words}:\n{record}");
    }
}

#[test]
fn a_hop_longer_than_the_limit_misses_the_limit() {
    let case = Case::new("limit", &[1; 2], "");
    let more = ["--spin", "--max-polled-us", "0.001"];
    let (ended, report) = bench(&case, &[&SERIES[..], &more].concat());
    assert_eq!(ended.status.code(), Some(6), "{}\n{report:#}", ended.stderr);
    assert_eq!(report["held"], false);
    assert_eq!(
        report["numbers"].as_array().unwrap().len(),
        2,
        "polling only"
    );
}

#[test]
fn measuring_more_cameras_than_exist_is_refused() {
    let case = Case::new("views", &[2; 2], "");
    let (ended, _) = bench(&case, &["scale", "deployment.toml", "--views", "3"]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    ended.says("the deployment has only 2 cameras");
}

/// Returns the number of bytes that the ports of a process have copied, from its log.
fn copied_bytes(stderr: &str, process: &str) -> usize {
    let said = format!(" {process}: ports have done their work copied_bytes=");
    let found = stderr.lines().find_map(|line| line.split_once(&said));
    let (_, bytes) = found.unwrap();
    bytes.trim().parse().unwrap()
}

#[test]
fn a_deployment_copies_poses_and_neither_pixels_nor_evidence() {
    const N_FRAMES: usize = 12;
    let case = Case::new("copies", &[N_FRAMES; 2], PLAIN);
    let ended = case.start(&["run", "deployment.toml", "--json", "-v"]).wait();
    case.assert_nothing_left();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    for view in 0..2 {
        let camera = copied_bytes(&ended.stderr, &format!("capture-{view}"));
        assert_eq!(camera, 0, "it sends nothing but pixels");
        // The end of the stream is also a message.
        let sent = (N_FRAMES + 1) * size_of::<Sightings>();
        let pose = copied_bytes(&ended.stderr, &format!("pose-{view}"));
        let most = sent + 4 * size_of::<Sightings>();
        assert!(
            (sent..=most).contains(&pose),
            "it reads pixels, and sends poses and evidence: {pose}"
        );
    }
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    let evidence = report["recorded"]["summary"]["evidence_bytes_per_frame"].as_object();
    let evidence: u64 = evidence.unwrap().values().map(|value| value.as_u64().unwrap()).sum();
    let fuse = copied_bytes(&ended.stderr, "fuse-0");
    let read = 2 * (N_FRAMES + 1) * size_of::<Sightings>();
    let sent = (N_FRAMES + 1) * size_of::<PairPose>();
    // The end of the stream may be sent more than once.
    let most = read + sent + 8 * size_of::<Sightings>();
    assert!(
        (read + sent..=most).contains(&fuse),
        "it reads poses and evidence, and sends pairs: {fuse}"
    );
    assert!(
        evidence as usize * N_FRAMES > fuse,
        "which is far more: {evidence} a frame"
    );
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use crate::common::PACED;

    use super::*;

    #[test]
    #[ignore = "takes long"]
    fn a_deployment_is_measured_with_all_cameras_and_with_a_dead_one() {
        let case = Case::new("latency", &[60; 3], PACED);
        let words = [
            "latency",
            "deployment.toml",
            "--views",
            "2",
            "--seconds",
            "2",
        ];
        let more = ["--out", "bench", "--spin", "--min-rate", "1000000"];
        let (ended, report) = bench(&case, &[&words[..], &more].concat());
        assert_eq!(ended.status.code(), Some(6), "{}\n{report:#}", ended.stderr);
        assert_eq!(report["limits"][0]["held"], false, "nobody is that fast");
        let [whole, dead] = &report["numbers"].as_array().unwrap()[..] else {
            panic!("{report:#}")
        };
        assert_eq!(whole["run"], "2 views");
        assert_eq!(whole["summary"]["restarts"], json!([]));
        assert!(whole["results"].as_u64() > Some(0), "{whole:#}");
        let ms = |value: &Value| value["p50"].as_f64().unwrap();
        let pose = ms(&whole["stages_ms"]["pose"]);
        assert!(
            pose > 0.0 && ms(&whole["end_to_end_ms"]) > pose,
            "{whole:#}"
        );
        assert!(whole["cpu_seconds"].as_f64() > Some(0.0), "{whole:#}");
        assert_eq!(dead["run"], "2 views, one camera killed");
        assert_eq!(dead["summary"]["given_up"], json!(["capture-1"]));
    }
}
