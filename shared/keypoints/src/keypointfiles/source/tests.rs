//! Tests of folders and files of keypoints.

use std::fs::{self, File};

use tempfile::TempDir;

use super::*;

/// Returns a frame of some people, each with 25 keypoints at one position.
fn frame(people: &[f64]) -> String {
    let person = |x: &f64| format!("{{\"pose_keypoints_2d\":{:?}}}", vec![*x; 75]);
    let people: Vec<String> = people.iter().map(person).collect();
    format!("{{\"people\":[{}]}}", people.join(","))
}

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn refused(files: &[(&str, &str)]) -> String {
    let folder = folder(files);
    let error = KeypointSource::open(folder.path(), None).unwrap_err();
    error.to_string()
}

#[test]
fn frames_of_a_folder_are_counted_from_its_first_file_and_missing_files_give_no_result() {
    let folder = folder(&[
        ("cam1_0012_keypoints.json", &frame(&[3.0, 4.0])),
        ("cam1_0010_keypoints.json", &frame(&[])),
        ("cam1_0013_keypoints.json", &frame(&[5.0])),
        (".cam1_0099.json", "hidden"),
        ("notes.txt", "other"),
    ]);
    let source = KeypointSource::open(folder.path(), None).unwrap();
    assert_eq!(source.n_frames(), 4);
    assert_eq!(source.names(), &NameSet::of_set("body-25").unwrap());
    let mut people = vec![SeenKeypoints::default(); 7];
    let expected = [Some(0), None, Some(2), Some(1), None];
    for (frame, expected) in (0..).zip(expected) {
        assert_eq!(source.of_frame(frame, &mut people).unwrap(), expected);
        assert_eq!(people.len(), expected.unwrap_or(0));
    }
    source.of_frame(2, &mut people).unwrap();
    assert_eq!(people[1].keypoints[24].unwrap().at, [4.0, 4.0]);
    assert_eq!(source.of_frame(u64::MAX, &mut people).unwrap(), None);
}

#[test]
fn a_malformed_file_is_named_and_the_others_are_read() {
    let folder = folder(&[
        ("a1.json", &frame(&[1.0])),
        ("a2.json", "{"),
        ("a3.json", &frame(&[1.0]).replace("1.0,", "")),
    ]);
    let names = NameSet::of_set("body-25").ok();
    let source = KeypointSource::open(folder.path(), names).unwrap();
    let mut people = Vec::new();
    let error = source.of_frame(1, &mut people).unwrap_err().to_string();
    assert!(
        error.contains("a2.json") && error.contains("line 1"),
        "{error}"
    );
    let error = source.of_frame(2, &mut people).unwrap_err().to_string();
    assert!(
        error.contains("a3.json: `people[0].pose_keypoints_2d`"),
        "{error}"
    );
    assert_eq!(source.of_frame(0, &mut people).unwrap(), Some(1));
}

#[test]
fn folders_without_frame_numbers_are_refused() {
    assert!(refused(&[]).contains("no file with the extension .json"));
    assert!(refused(&[("a.json", "{}")]).contains("a.json has no frame number"));
    let one = frame(&[1.0]);
    let twice = refused(&[("a_1.json", &one), ("b_01.json", &one)]);
    assert!(
        twice.contains("frame 1 has two files") && twice.contains("b_01.json"),
        "{twice}"
    );
    let far = refused(&[("1.json", &one), ("99999999999.json", &one)]);
    assert!(far.contains("1 to 99999999999"), "{far}");
    let nobody = refused(&[("1.json", &frame(&[]))]);
    assert!(nobody.contains("`keypoint_names`"), "{nobody}");
    let missing = KeypointSource::open(Path::new("/nowhere/at.json"), None).unwrap_err();
    assert!(missing.to_string().contains("/nowhere/at.json"));
}

#[test]
fn a_camera_without_people_needs_keypoint_names() {
    let folder = folder(&[("1.json", &frame(&[]))]);
    let names = NameSet::of_set("coco-17").unwrap();
    let source = KeypointSource::open(folder.path(), Some(names)).unwrap();
    assert_eq!(source.of_frame(0, &mut Vec::new()).unwrap(), Some(0));
}

#[test]
fn a_file_that_is_too_large_is_not_read() {
    let folder = folder(&[("1.json", &frame(&[1.0])), ("2.json", "")]);
    let large = File::create(folder.path().join("2.json")).unwrap();
    large.set_len(MOST_OF_FRAME + 1).unwrap();
    let names = NameSet::of_set("body-25").ok();
    let source = KeypointSource::open(folder.path(), names).unwrap();
    let error = source.of_frame(1, &mut Vec::new()).unwrap_err().to_string();
    assert!(
        error.contains("2.json has 16777217 bytes, but at most 16777216"),
        "{error}"
    );
}

#[test]
fn one_coco_file_contains_all_frames() {
    let result = |image: u64| {
        format!(
            "{{\"image_id\":{image},\"category_id\":1,\"keypoints\":{:?},\"score\":0.9}}",
            [0.5; 51]
        )
    };
    let text = format!("[{},{}]", result(0), result(2));
    let folder = folder(&[("results.json", &text), ("frame.json", "{\"people\":[]}")]);
    let source = KeypointSource::open(&folder.path().join("results.json"), None).unwrap();
    assert_eq!((source.n_frames(), source.names().n()), (3, 17));
    let mut people = Vec::new();
    let of: Vec<Option<usize>> = (0..4).map(|i| source.of_frame(i, &mut people).unwrap()).collect();
    assert_eq!(of, [Some(1), None, Some(1), None]);
    let error = KeypointSource::open(&folder.path().join("frame.json"), None).unwrap_err();
    assert!(error.to_string().contains("frame.json: expected"));
}

/// Returns a frame of one upright person, with the keypoints of a set whose names are listed below.
fn upright(names: &[&str]) -> String {
    let at = |name: &str| match name {
        "pelvis" => [101.0, 100.0],
        "left hip" => [110.0, 98.0],
        "right hip" => [90.0, 98.0],
        "right elbow" => [70.0, 80.0],
        "left wrist" => [140.0, 110.0],
        "head top" | "nose" => [100.0, 10.0],
        _ => [100.0, 200.0],
    };
    let values = names.iter().flat_map(|name| [at(name)[0], at(name)[1], 0.5]);
    let values: Vec<f64> = values.collect();
    format!("{{\"people\":[{{\"pose_keypoints_2d\":{values:?}}}]}}")
}

#[test]
fn the_layout_body_25b_of_openpose_is_distinguished_from_body_25() {
    let usual = upright(&BODY_25);
    let other = upright(&crate::BODY_25B);
    let open = |files: &[(&str, &str)], names: Option<&str>| {
        let folder = folder(files);
        let names = names.map(|name| NameSet::of_set(name).unwrap());
        let opened = KeypointSource::open(folder.path(), names);
        opened.map(|opened| opened.names().clone()).map_err(|error| error.to_string())
    };
    let taken = open(
        &[("1.json", &usual), ("2.json", &usual), ("3.json", &other)],
        None,
    );
    assert_eq!(taken, Ok(NameSet::of_number(25).unwrap()));
    let files: [(&str, &str); 2] = [("1.json", &other), ("2.json", &other)];
    let refused = open(&files, None).unwrap_err();
    assert!(
        refused.contains("keypoint_names = \"body-25b\""),
        "{refused}"
    );
    for set in ["body-25b", "body-25"] {
        assert_eq!(
            open(&files, Some(set)),
            NameSet::of_set(set).map_err(|error| error.to_string())
        );
    }
}
