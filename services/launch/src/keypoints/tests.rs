//! Tests of keypoints as the input of a deployment.

use std::fs;
use std::path::Path;

use deployment::{AnyMachine, Loaded};
use tempfile::TempDir;

use super::*;
use crate::cameras::Footage;

const RIG: &str = "\
[a]\nname = 'a'\nsize = [ 640.0, 480.0,]\nmatrix = [ [ 500.0, 0.0, 320.0,], [ 0.0, 500.0, 240.0,], [ 0.0, 0.0, 1.0,],]\n\
distortions = [ 0.0, 0.0, 0.0, 0.0,]\nrotation = [ 0.0, 0.0, 0.0,]\ntranslation = [ 0.0, 0.0, 3.0,]\nfisheye = false\n\
[b]\nname = 'b'\nsize = [ 320.0, 200.0,]\nmatrix = [ [ 500.0, 0.0, 160.0,], [ 0.0, 500.0, 100.0,], [ 0.0, 0.0, 1.0,],]\n\
distortions = [ 0.0, 0.0, 0.0, 0.0,]\nrotation = [ 0.0, 1.5, 0.0,]\ntranslation = [ 0.0, 0.0, 3.0,]\nfisheye = false\n";

/// Creates a folder with a rig, and with keypoints of 5 frames for camera `b`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), RIG).unwrap();
    let keypoints = folder.path().join("b_json");
    fs::create_dir(&keypoints).unwrap();
    for frame in 3..8 {
        let text = format!("{{\"people\":[{{\"pose_keypoints_2d\":{:?}}}]}}", [5.0; 75]);
        fs::write(keypoints.join(format!("b_{frame}_keypoints.json")), text).unwrap();
    }
    folder
}

fn deployment(folder: &Path, more: &str, set: &[&str]) -> Deployment {
    let text = format!(
        "name = 'one'\nrig = 'rig.toml'\noutput = 'out'\n[[camera]]\nname = 'a'\nsource = 'a.mp4'\n\
         [[camera]]\nname = 'b'\nkeypoints = 'b_json'\n{more}\n[network]\nfile = 'n.onnx'\n"
    );
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    let file = folder.join("deployment.toml");
    Loaded::parse(&text, &file, &set, &AnyMachine).unwrap().deployment
}

#[test]
fn a_camera_without_footage_gets_one_grey_frame_per_keypoint_frame() {
    let folder = folder();
    let deployment = deployment(folder.path(), "", &["capture.frame_rate_hz=50"]);
    let lengths = lengths(&deployment).unwrap();
    assert_eq!(lengths, [None, Some(5)]);
    let before = deployment.cameras[0].source.clone();
    let cameras = with_pictures(deployment, &lengths).unwrap().cameras;
    assert_eq!(cameras[0].source, before);
    assert_eq!(cameras[1].source, "blank://320x200?frames=5&rate=50");
}

#[test]
fn without_a_frame_rate_there_are_no_grey_frames() {
    let folder = folder();
    let deployment = deployment(folder.path(), "", &[]);
    let refused = with_pictures(deployment, &[None, Some(5)]).unwrap_err();
    assert_eq!(refused.kind(), ExitKind::Config);
    assert!(refused.to_string().contains("camera \"b\""), "{refused}");
}

#[test]
fn unreadable_keypoints_are_an_input_error_that_names_the_file() {
    let folder = folder();
    let deployment = deployment(folder.path(), "keypoint_names = 'coco-17'\n", &[]);
    let source = of_camera(&deployment.cameras[1]).unwrap().unwrap();
    let refused = source.of_frame(0, &mut Vec::new()).unwrap_err().to_string();
    assert!(
        refused.contains("b_3_keypoints.json") && refused.contains("expected 51"),
        "{refused}"
    );
    fs::remove_dir_all(folder.path().join("b_json")).unwrap();
    let refused = of_camera(&deployment.cameras[1]).unwrap_err();
    assert_eq!(refused.kind(), ExitKind::Input);
    assert!(refused.to_string().contains("b_json"), "{refused}");
}

#[test]
fn different_lengths_of_footage_and_keypoints_are_reported_with_both_numbers() {
    let folder = folder();
    let warnings = |n_frames: u64, set: &[&str]| {
        let footage = Footage {
            size: [640, 480],
            n_frames,
            frame_rate_hz: Some(50.0),
            timeline: None,
        };
        let resolved = Resolved {
            deployment: deployment(folder.path(), "source = 'b.mp4'\n", set),
            footage: vec![footage.clone(), footage],
            search_size: None,
            extra_keypoints: Vec::new(),
            sides_as_seen: false,
            host: None,
            recording: None,
            replay: None,
        };
        check_lengths(&resolved, &[None, Some(70)])
    };
    assert_eq!(warnings(70, &[]), Vec::<String>::new());
    assert_eq!(warnings(10, &["capture.n_frames=10"]), Vec::<String>::new());
    assert_eq!(
        warnings(20, &["capture.start_frame=10", "capture.frame_step=3"]),
        Vec::<String>::new()
    );
    let long = warnings(90, &[]);
    assert!(
        matches!(&long[..], [one] if one.contains("\"b\": 90 frames of footage and keypoints of 70")),
        "{long:?}"
    );
    let short = warnings(60, &[]);
    assert!(
        matches!(&short[..], [one] if one.contains("60 frames") && one.contains("last keypoints")),
        "{short:?}"
    );
}
