//! Tests of exported runs: folder and recording give the same files, and missing data is reported.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "what is skipped is told")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use formats::c3d::C3d;
use formats::trc::Trc;
use serde_json::{Value, json};

use crate::common::{Case, Ended, PLAIN};

const N_FRAMES: usize = 5;
/// Formats with one file.
const FILES: [&str; 6] = [
    "pose3d.c3d",
    "pose3d.trc",
    "pose3d.glb",
    "pose3d.bvh",
    "pose3d.csv",
    "pose3d-long.csv",
];
const ALL: &str = "c3d,trc,glb,bvh,csv,csv-long,openpose";

fn exported(case: &Case, source: &str, more: &[&str]) -> Ended {
    case.start(&[&["export", source], more].concat()).wait()
}

fn done(case: &Case, source: &str, more: &[&str]) -> Value {
    let ended = exported(case, source, &[more, &["--json"]].concat()).ends(0);
    serde_json::from_str(&ended.stdout).unwrap()
}

/// Returns `[frame][joint]`, in metres in the world; `None` in a gap.
fn found(case: &Case) -> Vec<Vec<Option<[f64; 3]>>> {
    let names = skeleton::PARSE14.joints.iter().map(|joint| joint.name);
    let of_line = |line: &Value| {
        let place = |name: &str| {
            let at = line["people"][0]["joints"][name]["position_m"].as_array()?;
            Some([0, 1, 2].map(|axis| at[axis].as_f64().unwrap()))
        };
        names.clone().map(place).collect()
    };
    case.lines("pose3d.jsonl").iter().map(of_line).collect()
}

#[test]
fn a_run_is_exported_from_its_folder_and_from_its_recording() {
    let case = Case::new("export", &[N_FRAMES; 2], PLAIN);
    case.start(&["record", "deployment.toml", "--out", "run.mcap"]).wait().ends(0);

    // The rate of the pictures is not known.
    exported(&case, "out", &["--to", ALL]).ends(2).says("--rate 30");
    let all = if cfg!(feature = "parquet") {
        format!("{ALL},parquet")
    } else {
        ALL.to_owned()
    };
    let told = ["--to", &all, "--rate", "20", "--up", "0,0,1"];
    let of_folder = done(&case, "out", &told);
    assert_eq!(of_folder["frames"], N_FRAMES);
    assert!(of_folder["people"][0]["frames_with_points"].as_u64().unwrap() > 0);
    done(&case, "run.mcap", &told);
    for name in FILES {
        let [a, b] = ["out/export", "run-export"].map(|from| fs::read(case.path(from).join(name)));
        assert!(a.unwrap() == b.unwrap(), "{name} differs");
    }
    check_positions(&case);
    check_with_python(&case);
    check_with_validator(&case.path("out/export"));

    exported(&case, "out", &told).ends(2).says("--force");

    check_videos(&case);

    let whole = fs::read(case.path("run.mcap")).unwrap();
    case.write("cut.mcap", &whole[..whole.len() * 2 / 3]);
    exported(&case, "cut.mcap", &["--to", "csv"]).ends(7).says("cut off");
}

/// Checks the positions in C3D (millimetres) and TRC (metres) against the run, with the readers of this workspace.
fn check_positions(case: &Case) {
    let found = found(case);
    let folder = case.path("out/export");
    let c3d = C3d::parse(&fs::read(folder.join("pose3d.c3d")).unwrap()).unwrap();
    let trc = Trc::parse(&fs::read_to_string(folder.join("pose3d.trc")).unwrap()).unwrap();
    assert_eq!((c3d.n_frames(), trc.frames.len()), (N_FRAMES, N_FRAMES));
    assert_eq!((c3d.rate_hz(), trc.rate_hz), (20.0, 20.0));
    let views: Vec<_> = fs::read_dir(folder.join("pose3d-openpose")).unwrap().collect();
    assert_eq!(views.len(), 3, "two views, and the mark of the folder");
    for (frame, due) in found.iter().enumerate() {
        for (joint, due) in due.iter().enumerate() {
            let [x, y, z] = due.unwrap_or([f64::NAN; 3]);
            let mm = c3d.frame(frame)[joint].map(|point| point.map(|value| value / 1e3));
            for (read, due) in [(mm, [x, y, z]), (trc.frames[frame][joint], [y, z, x])] {
                assert_eq!(
                    read.is_none(),
                    due[0].is_nan(),
                    "frame {frame}, joint {joint}"
                );
                let off = read.map_or(0.0, |read| {
                    (0..3).map(|axis| (read[axis] - due[axis]).abs()).fold(0.0, f64::max)
                });
                assert!(off < 1e-5, "frame {frame}, joint {joint}: {off} m");
            }
        }
    }
}

/// Returns the content that other programs read from a folder, by format. Formats that Python cannot read are left out, with a message.
fn read_by_python<'a>(folder: &Path, formats: &[&'a str]) -> Vec<(&'a str, Value)> {
    const SCRIPT: &str = include_str!("export.py");
    let read = Command::new("python3")
        .args(["-c", SCRIPT])
        .arg(folder)
        .args(formats)
        .current_dir(folder)
        .output();
    let Ok(read) = read else {
        eprintln!("skipped: no python3");
        return Vec::new();
    };
    let complaint = String::from_utf8_lossy(&read.stderr);
    assert!(read.status.success(), "{complaint}");
    // Some of these programs print notices first.
    let text = String::from_utf8_lossy(&read.stdout);
    let said: Value = serde_json::from_str(text.lines().last().unwrap_or_default()).unwrap();
    let all = formats.iter().map(|&format| (format, said[format].clone()));
    let (lacking, found): (Vec<_>, Vec<_>) = all.partition(|entry| entry.1.is_null());
    for (format, _) in lacking {
        eprintln!("skipped: Python has no package that reads {format} (see .ci/run)");
    }
    found
}

/// Checks the positions with other programs, if Python has them.
fn check_with_python(case: &Case) {
    let mut formats = vec!["c3d", "trc", "bvh", "glb", "csv"];
    if cfg!(feature = "parquet") {
        formats.push("parquet");
    }
    let found = found(case);
    for (format, said) in read_by_python(&case.path("out/export"), &formats) {
        let said = &said;
        match format {
            "glb" => {
                let is_moved = said["keys"] == json!([N_FRAMES]);
                assert!(is_moved && said["skins"] == 1, "{said}");
                assert_eq!(said["animations"], 1);
            }
            "bvh" => {
                assert_eq!(said["frames"], N_FRAMES);
                assert_eq!(said["is_finite"], true);
                assert!((said["seconds"].as_f64().unwrap() - 0.05).abs() < 1e-6);
            }
            _ => check_points(format, said, &found),
        }
    }
}

/// The run has missing joints anywhere in a row, missing rows, and more frames than fit into 16 bits.
#[test]
fn other_programs_can_open_exports_with_gaps_and_long_exports() {
    let folder = tempfile::tempdir().unwrap();
    let joints = ["right_ankle", "neck", "head"];
    let frames: Vec<Vec<Option<[f64; 3]>>> = (0..8)
        .map(|missing| {
            let place =
                |joint: usize| (missing >> joint & 1 == 0).then_some([joint as f64, 1.0, 2.0]);
            (0..3).map(place).collect()
        })
        .collect();
    let heading = formats::trc::Heading {
        file_name: "pose3d.trc",
        rate_hz: 60.0,
        units: "m",
        markers: &joints,
        n_rows: 8,
    };
    let rows = frames.iter().enumerate().map(|(nth, frame)| {
        // TRC has y up.
        let turned = frame.iter().map(|frame| frame.map(|[x, y, z]| [y, z, x]));
        formats::trc::row(nth as u64 + 1, nth as f64 / 60.0, turned)
    });
    let text = heading.to_string() + &rows.collect::<String>();
    fs::write(folder.path().join("pose3d.trc"), text).unwrap();

    let heading = formats::c3d::Heading {
        rate_hz: 60.0,
        units: "mm",
        up: "+Z",
        labels: &["head".to_owned()],
        descriptions: &[],
        n_frames: 70_000,
        first_frame: 1,
        residual_step: 0.5,
        software: ["test", "1"],
    };
    let marker = |nth: u32| formats::c3d::Marker {
        position: [f64::from(nth), 2.0, 3.0],
        residual: 1.0,
        cameras: 1,
    };
    let mut file = Vec::new();
    formats::c3d::write(
        &mut file,
        &heading,
        (1..=70_000).map(|i| vec![Some(marker(i))]),
    )
    .unwrap();
    fs::write(folder.path().join("long.c3d"), file).unwrap();

    for (format, said) in read_by_python(folder.path(), &["trc", "long"]) {
        if format == "long" {
            assert_eq!(
                said,
                json!({ "frames": 70_000, "last": [70_000.0, 2.0, 3.0] })
            );
            continue;
        }
        let read: Vec<Vec<Option<[f64; 3]>>> =
            serde_json::from_value(said["points"].clone()).unwrap();
        assert_eq!(read, frames);
    }
}

#[test]
fn the_files_for_opensim_name_the_same_markers_and_leave_other_files_in_the_folder() {
    let case = Case::new("export-opensim", &[2; 2], PLAIN);
    case.start(&["run", "deployment.toml"]).wait().ends(0);
    assert!(
        !case.path("out/pose3d.trc").exists(),
        "nothing tells its rate"
    );
    let told = ["--to", "opensim", "--rate", "20", "--up", "0,0,1"];
    let said = done(&case, "out", &told);
    let folder = case.path("out/export/pose3d-opensim");
    let read = |name: &str| fs::read_to_string(folder.join(name)).unwrap();
    let trc = Trc::parse(&read("markers.trc")).unwrap();
    assert_eq!(trc.markers[..3], ["RAnkle", "RKnee", "RHip"]);
    for file in ["markers.xml", "kinematics.xml"] {
        for marker in &trc.markers {
            assert!(
                read(file).contains(&format!(" name=\"{marker}\"")),
                "{file}: {marker}"
            );
        }
    }
    let notes = said["files"][0]["notes"].to_string();
    assert!(
        notes.contains("model.osim") && notes.contains("ankles"),
        "{notes}"
    );
    fs::write(folder.join("model.osim"), "mine").unwrap();
    done(&case, "out", &[&told[..], &["--force"]].concat());
    assert_eq!(read("model.osim"), "mine");
}

/// Checks `[frame][joint]` as read by another program, with null in gaps.
fn check_points(format: &str, said: &Value, found: &[Vec<Option<[f64; 3]>>]) {
    let joints = skeleton::PARSE14.joints.iter().map(|joint| joint.name);
    if format == "c3d" {
        assert_eq!(
            (&said["units"], &said["rate"]),
            (&json!("mm"), &json!(20.0))
        );
    } else {
        assert_eq!(said["joints"], json!(joints.collect::<Vec<_>>()));
    }
    let read: Vec<Vec<Option<[f64; 3]>>> = serde_json::from_value(said["points"].clone()).unwrap();
    assert_eq!(read.len(), found.len(), "{format}");
    for (frame, (read, due)) in read.iter().zip(found).enumerate() {
        assert_eq!(read.len(), due.len(), "{format}");
        for (joint, (read, due)) in read.iter().zip(due).enumerate() {
            let is_same = match (read, due) {
                (Some(read), Some(due)) => (0..3).all(|axis| (read[axis] - due[axis]).abs() < 1e-5),
                _ => read == due,
            };
            assert!(
                is_same,
                "{format}, frame {frame}, joint {joint}: {read:?}, {due:?}"
            );
        }
    }
}

/// Runs the official glTF validator, if Node has it.
fn check_with_validator(folder: &Path) {
    const SCRIPT: &str = "\
let validator;\n\
try { validator = require('gltf-validator'); } catch { process.exit(9); }\n\
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));\n\
validator.validateBytes(bytes).then((it) => console.log(JSON.stringify(it.issues)));\n";
    let file = folder.join("pose3d.glb");
    let read = Command::new("node").args(["-e", SCRIPT]).arg(file).output();
    let has = |output: &Output| output.status.code() != Some(9);
    let Some(read) = read.ok().filter(has) else {
        eprintln!("skipped: Node has no gltf-validator (npm install gltf-validator, NODE_PATH)");
        return;
    };
    let complaint = String::from_utf8_lossy(&read.stderr);
    let issues: Value = serde_json::from_slice(&read.stdout).unwrap_or_default();
    let of = |kind: &str| issues[kind].as_u64();
    let is_sound = (of("numErrors"), of("numWarnings")) == (Some(0), Some(0));
    assert!(is_sound, "{issues} {complaint}");
}

/// Checks videos from the footage, and from the recorded pictures when the footage is gone.
fn check_videos(case: &Case) {
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        eprintln!("skipped: videos, without ffmpeg");
        return;
    }
    let told = ["--to", "mp4", "--rate", "20"];
    let written = done(case, "out", &told);
    assert_eq!(written["files"].as_array().unwrap().len(), 2);
    let camera = written["files"][0]["path"].as_str().unwrap().to_owned();
    assert!(fs::metadata(case.path(&camera)).unwrap().len() > 1000);
    for entry in fs::read_dir(case.folder()).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && path.join("0000.png").exists() {
            fs::remove_dir_all(path).unwrap();
        }
    }
    done(case, "run.mcap", &told);
    exported(case, "out", &[&told[..], &["--force"]].concat())
        .ends(4)
        .says("no pictures to draw on");
}
