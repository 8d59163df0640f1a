//! Runs in the files of other tools: from the folder and from the recording the same, and what they lack is said.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "what is skipped is told")]

use std::fs;
use std::path::Path;
use std::process::Command;

use c3d::C3d;
use serde_json::Value;
use trc::Trc;

use crate::common::{Case, Ended, PLAIN};

const N_FRAMES: usize = 5;
/// Formats of one file.
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
    let ended = exported(case, source, &[more, &["--json"]].concat());
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    serde_json::from_str(&ended.stdout).unwrap()
}

/// `[frame][joint]`, metres in the world; none in a gap.
fn found(case: &Case) -> Vec<Vec<Option<[f64; 3]>>> {
    let names = skeleton::PARSE14.joints.iter().map(|it| it.name);
    let of_line = |line: &Value| {
        let place = |name: &str| {
            let at = line["joints"][name]["position_m"].as_array()?;
            Some([0, 1, 2].map(|axis| at[axis].as_f64().unwrap()))
        };
        names.clone().map(place).collect()
    };
    case.lines("pose3d.jsonl").iter().map(of_line).collect()
}

#[test]
fn a_run_is_exported_from_its_folder_and_from_its_recording() {
    let case = Case::new("export", &[N_FRAMES; 2], PLAIN);
    let ended = case
        .start(&["record", "deployment.toml", "--out", "run.mcap"])
        .wait();
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);

    // Nothing tells the rate of pictures.
    let ended = exported(&case, "out", &["--to", ALL]);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("--rate 30"), "{}", ended.stderr);
    let told = ["--to", ALL, "--rate", "20", "--up", "0,0,1"];
    let of_folder = done(&case, "out", &told);
    assert_eq!(of_folder["frames"], N_FRAMES);
    assert!(of_folder["frames_with_points"].as_u64().unwrap() > 0);
    done(&case, "run.mcap", &told);
    for name in FILES {
        let [a, b] = ["out/export", "run-export"].map(|it| fs::read(case.path(it).join(name)));
        assert!(a.unwrap() == b.unwrap(), "{name} differs");
    }
    check_positions(&case);
    check_with_python(&case.path("out/export"));

    let ended = exported(&case, "out", &told);
    assert_eq!(ended.status.code(), Some(2), "{}", ended.stderr);
    assert!(ended.stderr.contains("--force"), "{}", ended.stderr);

    check_videos(&case);

    let whole = fs::read(case.path("run.mcap")).unwrap();
    case.write("cut.mcap", &whole[..whole.len() * 2 / 3]);
    let ended = exported(&case, "cut.mcap", &["--to", "csv"]);
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    assert!(ended.stderr.contains("cut off"), "{}", ended.stderr);
}

/// C3D in millimetres and TRC in metres are where the run says, by the readers of this workspace.
fn check_positions(case: &Case) {
    let found = found(case);
    let folder = case.path("out/export");
    let c3d = C3d::parse(&fs::read(folder.join("pose3d.c3d")).unwrap()).unwrap();
    let trc = Trc::parse(&fs::read_to_string(folder.join("pose3d.trc")).unwrap()).unwrap();
    assert_eq!((c3d.n_frames(), trc.frames.len()), (N_FRAMES, N_FRAMES));
    assert_eq!((c3d.rate_hz(), trc.rate_hz), (20.0, 20.0));
    let views: Vec<_> = fs::read_dir(folder.join("pose3d-openpose"))
        .unwrap()
        .collect();
    assert_eq!(views.len(), 3, "two views, and the mark of the folder");
    for (frame, due) in found.iter().enumerate() {
        for (joint, due) in due.iter().enumerate() {
            let [x, y, z] = due.unwrap_or([f64::NAN; 3]);
            let mm = c3d.frame(frame)[joint].map(|it| it.map(|it| it / 1e3));
            for (read, due) in [(mm, [x, y, z]), (trc.frames[frame][joint], [y, z, x])] {
                assert_eq!(
                    read.is_none(),
                    due[0].is_nan(),
                    "frame {frame}, joint {joint}"
                );
                let off = read.map_or(0.0, |it| {
                    (0..3)
                        .map(|axis| (it[axis] - due[axis]).abs())
                        .fold(0.0, f64::max)
                });
                assert!(off < 1e-5, "frame {frame}, joint {joint}: {off} m");
            }
        }
    }
}

/// The same by programs of others, where Python has them.
fn check_with_python(folder: &Path) {
    const SCRIPT: &str = "\
import sys, ezc3d, bvh\n\
file = ezc3d.c3d(sys.argv[1] + '/pose3d.c3d')\n\
animation = bvh.Bvh(open(sys.argv[1] + '/pose3d.bvh').read())\n\
print(file['data']['points'].shape[1:], animation.nframes, len(animation.get_joints_names()))\n";
    let has = Command::new("python3")
        .args(["-c", "import ezc3d, bvh"])
        .output();
    if !has.is_ok_and(|it| it.status.success()) {
        eprintln!("skipped: Python has no ezc3d and bvh (pip install ezc3d bvh)");
        return;
    }
    let read = Command::new("python3")
        .args(["-c", SCRIPT])
        .arg(folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&read.stdout).into_owned();
    assert!(
        said.starts_with(&format!("(14, {N_FRAMES}) {N_FRAMES} ")),
        "{said}"
    );
}

/// Videos of the footage, and of the pictures of the recording where the footage is gone.
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
    let ended = exported(case, "out", &[&told[..], &["--force"]].concat());
    assert_eq!(ended.status.code(), Some(4), "{}", ended.stderr);
    assert!(
        ended.stderr.contains("no pictures to draw on"),
        "{}",
        ended.stderr
    );
}
