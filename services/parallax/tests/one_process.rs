//! Tests that separate processes and a single process give the same bits, for people found by networks and for another program's keypoints.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use footage::Canvas;
use kernels::Rgb8View;
use keypoints::HALPE_26;
use serde_json::Value;

use crate::common::Case;
use crate::common::same_bits::assert_same_skeleton;
use crate::maps::{
    N_FRAMES, Named, SIZE, as_it_is, case, exchanged, picture, rig, run, with_keypoints,
    without_a_wrist,
};

/// Settings with which every picture becomes a frame of the pipeline without change.
const AS_THEY_ARE: [&str; 2] = ["capture.mode=lossless", "capture.scale=1.0"];

/// Runs a case with [`AS_THEY_ARE`].
fn run_as_they_are(case: &Case) {
    let [mode, scale] = AS_THEY_ARE;
    run(case, &["--set", mode, "--set", scale]).ends(0);
}

/// Compares the results of a run with those of the same steps in one process, bit for bit.
///
/// * `pictures`: pictures by view and frame. They are also the frames of the pipeline.
fn assert_one_process_gives_the_same(case: &Case, pictures: &[Vec<Canvas>; 4]) {
    let file = case.path("deployment.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let set = AS_THEY_ARE.map(str::to_owned);
    let loaded = deployment::Loaded::parse(&text, &file, &set, &deployment::AnyMachine).unwrap();
    let resolved = launch::plan::resolve(&loaded.deployment).unwrap();
    let mut one = launch::InProcess::new(&resolved).unwrap();
    let lines = case.lines("pose3d.jsonl");
    assert_eq!(lines.len(), N_FRAMES);
    let mut n_joints = 0;
    for (frame, line) in lines.iter().enumerate() {
        let [width, height] = SIZE.map(|side| side as usize);
        let images = pictures.iter().map(|view| view[frame].rgb());
        let images = images.map(|rgb| Rgb8View::new(width, height, rgb).unwrap());
        let sent: Vec<Option<launch::SentFrame<'_>>> = images
            .map(|image| {
                Some(launch::SentFrame {
                    image,
                    skew_nanos: 0,
                })
            })
            .collect();
        let estimate = one.estimate(&sent).unwrap();
        assert_eq!(estimate.skeletons.len(), 1, "frame {frame}");
        let person = &estimate.skeletons[0];
        assert_same_skeleton(line, frame, &person.skeleton);
        n_joints += person.skeleton.joints.iter().flatten().count();
    }
    assert!(
        n_joints > 12 * N_FRAMES,
        "little to compare: {n_joints} joints"
    );
}

/// Returns the pictures of a case whose views name the joints correctly.
fn pictures(named: [Named; 4]) -> [Vec<Canvas>; 4] {
    let rig = rig();
    core::array::from_fn(|view| {
        let camera = &rig.cameras()[view];
        let frames = 0..N_FRAMES;
        frames.map(|frame| picture(camera, frame, named[view])).collect()
    })
}

#[test]
fn many_processes_give_the_same_bits_as_one() {
    let named: [Named; 4] = [as_it_is, exchanged, as_it_is, without_a_wrist];
    let case = case("one-process", named.map(Some));
    run_as_they_are(&case);
    assert_one_process_gives_the_same(&case, &pictures(named));
}

#[test]
fn many_processes_give_the_same_bits_as_one_with_predicted_people() {
    let case = case("one-predicted", [Some(as_it_is); 4]);
    case.set_network("file = \"net.onnx\"\ndetector = \"det.onnx\"\nlooks = 0.6");
    let file = case.path("deployment.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    case.write(
        "deployment.toml",
        format!("{text}\n[capture]\nframe_rate_hz = 30.0\n"),
    );
    run_as_they_are(&case);
    let summary = std::fs::read_to_string(case.path("out/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    let predicted = summary["summary"]["sightings_predicted"].as_u64().unwrap();
    assert!(predicted > N_FRAMES as u64, "{predicted}");
    assert_one_process_gives_the_same(&case, &pictures([as_it_is; 4]));
}

#[test]
fn many_processes_give_the_same_bits_as_one_with_keypoint_files() {
    let case = case("one-by-keypoints", [Some(as_it_is); 4]);
    with_keypoints(&case, "halpe-26", |_| HALPE_26.map(str::to_owned).to_vec());
    run_as_they_are(&case);
    assert_one_process_gives_the_same(&case, &pictures([as_it_is; 4]));
}
