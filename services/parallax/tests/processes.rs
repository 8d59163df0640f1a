//! Whole deployments of real processes: the same bits as one process, and what faults leave of them.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod common;

use common::started::signal;
use common::{Case, planted};
use geometry::files::ReadOptions;
use kernels::Rgb8View;
use pipeline::{Estimate, Estimator, EstimatorSettings};
use serde_json::{Value, json};
use skeleton::PARSE14;

/// No overlays and no turning, so that frames are the pictures as they were planted.
const PLAIN: &str =
    "[capture]\nupright = false\n[record]\noverlay_every = 0\n[fuse]\nworkers = 2\n";

/// The same at a pace that leaves time to interfere.
const PACED: &str = "[capture]\nupright = false\npace = \"realtime\"\nframe_rate_hz = 20\n\
                     [record]\noverlay_every = 0\n[fuse]\nworkers = 2\n";

/// Compares the results of a run with those of one process, bit for bit.
fn assert_same_bits(case: &Case, n_views: usize, n_frames: usize) {
    let rig = geometry::files::read(&case.path("rig.toml"), &ReadOptions::default()).unwrap();
    let model = planted::model();
    let (up, settings) = (rig.up_in_world(), EstimatorSettings::default());
    let mut estimator = Estimator::new(&model, rig.cameras(), up, &settings).unwrap();
    let (pose3d, pose2d) = (case.lines("pose3d.jsonl"), case.lines("pose2d.jsonl"));
    assert_eq!((pose3d.len(), pose2d.len()), (n_frames, n_frames * n_views));
    let mut n_placed = 0;
    for frame in 0..n_frames {
        let pictures: Vec<_> = rig
            .cameras()
            .iter()
            .map(|it| planted::picture(it, frame))
            .collect();
        let [width, height] = planted::SIZE.map(|it| it as usize);
        let images: Vec<_> = pictures
            .iter()
            .map(|it| Some(Rgb8View::new(width, height, it.rgb()).unwrap()))
            .collect();
        let estimate = estimator.estimate(&images, &vec![None; n_views]);
        n_placed += estimate.skeleton.joints.iter().flatten().count();
        assert_same_skeleton(&pose3d[frame], frame, &estimate);
        for view in 0..n_views {
            let line = &pose2d[frame * n_views + view];
            assert_eq!(
                (&line["frame"], &line["view"]),
                (&json!(frame), &json!(planted::name(view)))
            );
            let answer = estimate.answers[view].as_ref().unwrap();
            let best = &answer.candidates[0];
            assert_eq!(line["single"]["candidates"], json!(answer.candidates.len()));
            assert_eq!(line["single"]["score"], json!(best.score));
            assert_eq!(line["single"]["level"], json!(best.level + 1));
            let layout = estimator.plans()[view].layout();
            let parts = (0..model.n_parts()).map(|part| {
                let [x, y] = best.centre(&model, layout, part);
                json!({ "x": x, "y": y, "type": best.parts[part].mixture + 1 })
            });
            assert_eq!(line["single"]["parts"], parts.collect::<Value>());
            let fused = estimate.skeleton.views[view].as_ref().unwrap();
            let parts = fused.pose.centres_px.iter();
            let parts: Value = parts.map(|[x, y]| json!({ "x": x, "y": y })).collect();
            assert_eq!(line["fused"]["parts"], parts, "frame {frame}, view {view}");
            assert_eq!(line["fused"]["energy"], json!(fused.pose.energy));
            assert_eq!(line["facing"] == json!("behind"), fused.exchanged);
        }
    }
    assert!(
        n_placed > 10 * n_frames,
        "little to compare: {n_placed} joints"
    );
}

fn assert_same_skeleton(line: &Value, frame: usize, estimate: &Estimate) {
    assert_eq!(line["frame"], json!(frame));
    assert_eq!(line["pairs"], json!(estimate.skeleton.n_pairs));
    assert_eq!(
        line["facing_margin"],
        json!(estimate.skeleton.facing_margin)
    );
    for (joint, expected) in PARSE14.joints.iter().zip(&estimate.skeleton.joints) {
        let got = &line["joints"][joint.name];
        let Ok(expected) = expected else {
            assert_eq!(
                got["position_m"],
                Value::Null,
                "frame {frame}, {}",
                joint.name
            );
            continue;
        };
        let c = &expected.covariance;
        let covariance = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|it| c[it]);
        let position: [f64; 3] = expected.in_world.coords.into();
        assert_eq!(
            got["position_m"],
            json!(position),
            "frame {frame}, {}",
            joint.name
        );
        assert_eq!(got["covariance_m2"], json!(covariance));
        assert_eq!(got["reprojection_px"], json!(expected.reprojection_px));
    }
}

/// The frame numbers of a run's results.
fn frames(lines: &[Value]) -> Vec<u64> {
    lines
        .iter()
        .map(|it| it["frame"].as_u64().unwrap())
        .collect()
}

#[test]
fn many_processes_give_the_same_bits_as_one() {
    let case = Case::new("parity", &[20; 3], PLAIN);
    let ended = case.run();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    assert_same_bits(&case, 3, 20);
}

#[test]
fn deployments_side_by_side_do_not_meet() {
    let cases = [
        Case::new("left", &[12; 2], PLAIN),
        Case::new("right", &[9; 3], PLAIN),
    ];
    let started = cases
        .each_ref()
        .map(|it| it.start(&["run", "deployment.toml"]));
    for started in started {
        let ended = started.wait();
        assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    }
    assert_same_bits(&cases[0], 2, 12);
    assert_same_bits(&cases[1], 3, 9);
    cases.iter().for_each(Case::assert_nothing_left);
}

#[test]
fn an_interrupted_run_ends_cleanly() {
    // To the parent alone as `kill` does, and to all processes at once as a terminal does.
    for (name, sign) in [("int-one", 1), ("int-all", -1)] {
        let case = Case::new(name, &[400; 2], PACED);
        let mut started = case.start(&["run", "deployment.toml"]);
        started.until("three frames", |_| case.lines("pose3d.jsonl").len() >= 3);
        signal("INT", sign * started.id());
        let ended = started.wait();
        assert_eq!(ended.status.code(), Some(130), "{name}: {}", ended.stderr);
        case.assert_nothing_left();
        let lines = case.lines("pose3d.jsonl");
        assert!(
            (3..400).contains(&lines.len()),
            "{name}: {} frames",
            lines.len()
        );
    }
}

#[test]
fn a_killed_pose_process_comes_back_and_its_gap_is_told() {
    let case = Case::new("kill-pose", &[100; 3], PACED);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    let pid = started.pid_of("pose --index 1");
    signal("KILL", pid.into());
    let ended = started.wait();
    case.assert_nothing_left();
    let lines = case.lines("pose3d.jsonl");
    assert_eq!(
        frames(&lines),
        (0..100).collect::<Vec<_>>(),
        "{}: {}",
        ended.status,
        ended.stderr
    );
    let all = json!(["a", "b", "c"]);
    let without = lines.iter().filter(|it| it["views_present"] != all);
    let without: Vec<_> = without.map(|it| it["views_present"].clone()).collect();
    assert!(
        without.iter().all(|it| *it == json!(["a", "c"])),
        "{without:?}"
    );
    assert_eq!(lines[99]["views_present"], all, "the view is not back");
    // A process that was lost is told even if no frame missed its view.
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(
        report["restarts"],
        json!([{ "process": "pose-1", "restarts": 1 }]),
        "{}",
        ended.stderr
    );
    let missing = &report["recorded"]["summary"]["frames_with_views_missing"];
    assert_eq!(*missing, json!(without.len()));
}

#[test]
fn a_view_that_ends_early_is_missing_from_there_on() {
    let case = Case::new("short", &[12, 12, 7], PLAIN);
    let ended = case.run();
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let lines = case.lines("pose3d.jsonl");
    assert_eq!(
        frames(&lines),
        (0..12).collect::<Vec<_>>(),
        "{}",
        ended.stderr
    );
    for (frame, line) in lines.iter().enumerate() {
        let views: &[&str] = if frame < 7 {
            &["a", "b", "c"]
        } else {
            &["a", "b"]
        };
        assert_eq!(line["views_present"], json!(views), "frame {frame}");
    }
}

#[test]
fn a_killed_recorder_stops_nobody_and_counts_what_it_missed() {
    let case = Case::new("kill-record", &[100; 2], PACED);
    let mut started = case.start(&["run", "deployment.toml", "--json"]);
    started.until("ten frames", |_| case.lines("pose3d.jsonl").len() >= 10);
    let pid = started.pid_of("record");
    signal("KILL", pid.into());
    let ended = started.wait();
    case.assert_nothing_left();
    let report: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(
        report["restarts"],
        json!([{ "process": "record", "restarts": 1 }]),
        "{}",
        ended.stderr
    );
    let frames = frames(&case.lines("pose3d.jsonl"));
    assert!(frames.is_sorted_by(|a, b| a < b), "{frames:?}");
    assert_eq!(
        (frames[0], frames.last()),
        (0, Some(&99)),
        "{}: {}",
        ended.status,
        ended.stderr
    );
    assert_eq!(ended.status.code(), Some(7), "{report:#}\n{}", ended.stderr);
}
