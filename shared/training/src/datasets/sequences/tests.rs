//! Tests that write and read every layout.

use std::path::Path;

use geometry::files::Format;
use geometry::{Camera, Intrinsics, Lens, LensModel, Rig};
use nalgebra::{Isometry3, Point3, Vector3};
use skeleton::{PARSE14, UMPM15};
use testkit::c3d::{Processor, Trial, write};

use crate::datasets::sequences::{Alignment, Options, SequenceError, read};

/// A rig of cameras on a circle of 4 m.
pub(crate) fn rig(names: &[&str], size: [u32; 2]) -> Rig {
    let camera = |(nth, name): (usize, &&str)| {
        let angle = 0.9 * nth as f64;
        let eye = Point3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 1.0);
        Camera {
            name: (*name).to_owned(),
            intrinsics: Intrinsics {
                fx: 500.0,
                fy: 500.0,
                cx: 300.0,
                cy: 240.0,
                size,
                lens: Lens::new(LensModel::Pinhole),
            },
            camera_from_world: Isometry3::look_at_lh(&eye, &Point3::origin(), &-Vector3::z()),
        }
    };
    let cameras = names.iter().enumerate().map(camera).collect();
    Rig::new(cameras, Some(Vector3::z_axis()), "a test").unwrap()
}

pub(crate) fn touch(file: &Path) {
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(file, "").unwrap();
}

/// A sequence of two people of 15 joints; joint `j` of pose `p` is at `(p, j, 0)` mm.
fn umpm(root: &Path) {
    let folder = root.join("p2_chair_2");
    std::fs::create_dir_all(folder.join("Groundtruth")).unwrap();
    let description = "{\"id\": 1, \"calib\": \"calib_l06\",}";
    std::fs::write(folder.join("p2_chair_2.json"), description).unwrap();
    let names = ["f", "l", "r", "s"].map(|name| format!("calib_l06_{name}"));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    std::fs::create_dir_all(root.join("Calib")).unwrap();
    geometry::files::write(&root.join("Calib"), Format::Umpm, &rig(&names, [644, 486])).unwrap();
    for camera in ["f", "l", "r", "s"] {
        touch(&folder.join(format!("Video/p2_chair_2_{camera}.avi")));
    }
    let frame = |pose: usize| {
        let joint = |value: usize| Some([pose as f64, value as f64, 0.0]);
        (0..30).map(joint).collect()
    };
    let trial = Trial {
        rate_hz: 100.0,
        units: "mm".to_owned(),
        labels: (0..30).map(|i| format!("J{i}")).collect(),
        frames: (0..9).map(frame).collect(),
        n_analog: 0,
    };
    let file = folder.join("Groundtruth/p2_chair_2_vm.c3d");
    std::fs::write(file, write(&trial, Processor::Intel, None)).unwrap();
}

#[test]
fn every_second_pose_in_umpm_belongs_to_a_video_frame() {
    let dir = tempfile::tempdir().unwrap();
    umpm(dir.path());
    let poses = |alignment| {
        let options = Options {
            alignment,
            share: None,
        };
        let got = read(dir.path(), &options).unwrap().remove(0);
        assert_eq!((got.action.as_str(), got.joints), ("Chair", &UMPM15));
        assert_eq!(got.views.len(), 4);
        let pose = |frame: &crate::datasets::sequences::Frame| {
            let [x, y, _] = frame.joints[14].unwrap();
            assert!((y - 0.014).abs() < 1e-9, "metres, of the first person");
            (frame.index, (x * 1000.0).round() as u32)
        };
        got.frames.iter().map(pose).collect::<Vec<_>>()
    };
    assert_eq!(
        poses(Alignment::Direct),
        [(0, 0), (1, 2), (2, 4), (3, 6), (4, 8)]
    );
    assert_eq!(poses(Alignment::OneLate), [(1, 0), (2, 2), (3, 4), (4, 6)]);
}

#[test]
fn a_packed_video_of_umpm_is_an_error_with_advice() {
    let dir = tempfile::tempdir().unwrap();
    umpm(dir.path());
    let video = dir.path().join("p2_chair_2/Video/p2_chair_2_r.avi");
    std::fs::rename(&video, video.with_extension("avi.xz")).unwrap();
    let got = read(dir.path(), &Options::default()).unwrap_err();
    assert!(got.to_string().contains("unpack"), "{got}");
}

#[test]
fn the_last_fifth_of_the_frames_can_be_selected() {
    let dir = tempfile::tempdir().unwrap();
    umpm(dir.path());
    let options = Options {
        share: Some([0.8, 1.0]),
        ..Options::default()
    };
    let got = read(dir.path(), &options).unwrap().remove(0);
    let numbers: Vec<u64> = got.frames.iter().map(|frame| frame.number).collect();
    assert_eq!(numbers, [5]);
}

fn synthetic(folder: &Path, lines: &[String]) {
    std::fs::create_dir_all(folder).unwrap();
    let rig = rig(&["A", "B"], [640, 480]);
    geometry::files::write(&folder.join("rig.toml"), Format::Own, &rig).unwrap();
    std::fs::write(folder.join("truth.jsonl"), lines.join("\n")).unwrap();
}

fn truth_lines() -> Vec<String> {
    let names: Vec<&str> = PARSE14.joints.iter().map(|joint| joint.name).collect();
    let header = serde_json::json!({
        "format": "parallax-truth", "version": 2, "subject": 3, "action": "walking", "seed": 1,
        "frame_rate_hz": 30.0, "up": [0.0, 0.0, 1.0], "joints": names, "cameras": ["A", "B"],
    });
    let frame = |nth: u64| {
        let joints = vec![[nth as f64, 0.5, 1.0]; 14];
        serde_json::json!({ "frame": nth, "seconds": 0.0, "joints": joints, "views": [] })
    };
    let frames = (0..3).map(frame);
    std::iter::once(header).chain(frames).map(|line| line.to_string()).collect()
}

#[test]
fn synthetic_scenes_are_read() {
    let dir = tempfile::tempdir().unwrap();
    synthetic(&dir.path().join("s3-walking"), &truth_lines());
    let got = read(dir.path(), &Options::default()).unwrap().remove(0);
    assert_eq!(
        (got.name.as_str(), got.action.as_str()),
        ("s3 walking", "walking")
    );
    assert_eq!(got.frame_rate_hz, Some(30.0));
    assert_eq!(got.frames.len(), 3);
    assert_eq!(got.frames[2].joints[13], Some([2.0, 0.5, 1.0]));
    assert!(got.views[1].source.ends_with("cameras/B"));
}

#[test]
fn an_invalid_line_of_a_synthetic_scene_is_named() {
    let dir = tempfile::tempdir().unwrap();
    for (line, replaced, by, expected) in [
        (0, "parallax-truth", "other", "line 1"),
        (0, "neck", "throat", "line 1"),
        (0, "\"B\"", "\"C\"", "line 1"),
        (2, "[1.0,0.5,1.0],", "", "line 3"),
        (3, "frame", "fram", "line 4"),
    ] {
        let mut lines = truth_lines();
        lines[line] = lines[line].replacen(replaced, by, 1);
        synthetic(dir.path(), &lines);
        let got = read(dir.path(), &Options::default()).unwrap_err();
        assert!(got.to_string().contains(expected), "{got}");
    }
}

#[test]
fn any_other_sequence_can_be_described_by_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let (folder, file) = (dir.path(), dir.path().join("walk.toml"));
    geometry::files::write(
        &folder.join("rig.toml"),
        Format::Own,
        &rig(&["A", "B"], [640, 480]),
    )
    .unwrap();
    let names: Vec<String> = (0..14).map(|i| format!("M{i}")).collect();
    let cells: Vec<String> = (0..14).map(|i| format!("{i}\t2\t3")).collect();
    let trc = format!(
        "PathFileType\t4\nDataRate\tUnits\n60\tm\nFrame#\tTime\t{}\n\n1\t0\t{}\n",
        names.join("\t\t\t"),
        cells.join("\t")
    );
    std::fs::write(folder.join("walk.trc"), trc).unwrap();
    let description = format!(
        "name = \"walk\"\nrig = \"rig.toml\"\n\
         [[camera]]\nname = \"B\"\nsource = \"b.mp4\"\nfirst_frame = 4\n\
         [truth]\ntrc = \"walk.trc\"\nworld_from_file = [\"z\", \"x\", \"y\"]\n\
         joints = \"parse14\"\nmarkers = {names:?}\n"
    );
    std::fs::write(&file, &description).unwrap();
    let got = read(&file, &Options::default()).unwrap().remove(0);
    assert_eq!(got.rig.cameras()[0].name, "B");
    assert_eq!(got.views[0].first, 4);
    assert_eq!(got.frame_rate_hz, Some(60.0));
    assert_eq!(got.frames[0].joints[5], Some([3.0, 5.0, 2.0]));

    std::fs::write(&file, description.replace("\"B\"", "\"D\"")).unwrap();
    let wrong = read(&file, &Options::default());
    assert!(
        matches!(wrong, Err(SequenceError::NoCamera { .. })),
        "{wrong:?}"
    );
    std::fs::write(&file, description.replace("\"M3\"", "\"none\"")).unwrap();
    let wrong = read(&file, &Options::default());
    assert!(
        matches!(wrong, Err(SequenceError::NoPoint { .. })),
        "{wrong:?}"
    );
}

#[test]
fn an_empty_folder_is_not_recognised_as_a_data_set() {
    let dir = tempfile::tempdir().unwrap();
    let got = read(dir.path(), &Options::default());
    assert!(matches!(got, Err(SequenceError::Unknown { .. })), "{got:?}");
}
