//! Tests with known clocks of cameras: found from keypoints, written into the deployment, and used by a run.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use core::fmt::Write as _;
use std::process::Command;

use geometry::Rig;
use nalgebra::Point3;
use scene::{RigChoice, Scene, Settings};
use serde_json::Value;

use crate::common::{Case, Ended};

/// Frames per second of [`case`].
pub(crate) const RATE_HZ: f64 = 25.0;
const N_FRAMES: usize = 150;
/// Time of the first frame of every camera, in seconds. They are at most 13.4 frames apart.
const BEGIN_S: [f64; 3] = [0.2, 0.736, 0.456];
/// A comment that must be kept.
const COMMENT: &str = "# the second camera hangs from the ceiling";

/// Returns a scene with a walking person, seen by three cameras.
pub(crate) fn scene() -> Scene {
    let rig = RigChoice::Ring {
        n: 3,
        radius: 4.2,
        height: 1.5,
    };
    Scene::new(&Settings {
        rig,
        ..Settings::default()
    })
    .unwrap()
}

/// Creates a deployment that has only keypoints.
///
/// * `time_s`: time of the person in each frame of a camera, in seconds.
pub(crate) fn case(
    scene: &Scene,
    rig: &Rig,
    n_frames: usize,
    time_s: impl Fn(usize, usize) -> f64,
) -> Case {
    let case = Case::with_rig(rig, "sync", &[0; 3], "");
    let mut text = format!(
        "name = {:?}\nrig = \"rig.toml\"\noutput = \"out\"\n[capture]\nframe_rate_hz = {RATE_HZ:?}\n[results]\noverlay_every = 0\n",
        case.name
    );
    for (view, camera) in rig.cameras().iter().enumerate() {
        let name = &camera.name;
        for frame in 0..n_frames {
            let joints = scene.joints(time_s(view, frame)).into_iter();
            let numbers = joints.map(|joint| {
                let at = camera.project(&Point3::from(joint)).unwrap();
                format!("{:.2},{:.2},0.9", at.x, at.y)
            });
            let person = numbers.collect::<Vec<String>>().join(",");
            let json = format!("{{\"people\":[{{\"pose_keypoints_2d\":[{person}]}}]}}");
            case.write(&format!("{name}/{name}_{frame:06}_keypoints.json"), json);
        }
        let comment = if view == 1 { COMMENT } else { "" };
        writeln!(
            text,
            "[[camera]]\nname = {name:?} {comment}\nkeypoints = {name:?}\nkeypoint_names = \"lsp-14\""
        )
        .unwrap();
    }
    case.write("deployment.toml", text);
    case
}

fn estimate(case: &Case, more: &[&str]) -> Ended {
    let arguments = [&["sync", "estimate", "deployment.toml"], more].concat();
    case.start(&arguments).wait()
}

#[test]
fn clock_offsets_are_estimated_written_and_used() {
    let scene = scene();
    let rig = scene.rig();
    let case = case(&scene, rig, N_FRAMES, |view, frame| {
        BEGIN_S[view] + frame as f64 / RATE_HZ
    });
    let ended = estimate(
        &case,
        &["--window", "1", "--out", "clocks.html", "--write", "--json"],
    )
    .ends(0);
    let found: Value = serde_json::from_str(&ended.stdout).unwrap();
    assert_eq!(found["is_determined"], true);
    for (camera, begin_s) in found["cameras"].as_array().unwrap().iter().zip(BEGIN_S) {
        let off_ms = camera["offset_ms"].as_f64().unwrap() - 1e3 * (begin_s - BEGIN_S[0]);
        assert!(off_ms.abs() < 2.0, "{found:#}");
    }
    let page = std::fs::read_to_string(case.path("clocks.html")).unwrap();
    assert_eq!(page.matches("<svg").count(), 3, "a plot for every pair");
    let text = std::fs::read_to_string(case.path("deployment.toml")).unwrap();
    assert!(
        text.contains(COMMENT) && text.matches("offset_ms = ").count() == 3,
        "{text}"
    );
    let set = [
        "--set",
        "capture.frame_step=20",
        "--set",
        "capture.n_frames=6",
    ];
    case.start(&[&["run", "deployment.toml"], &set[..]].concat()).wait().ends(0);
    let lines = case.lines("pose3d.jsonl");
    assert_eq!(lines.len(), 6);
    for line in lines {
        let instant = line["frame"].as_u64().unwrap() as f64;
        // Frame 0 of the run is at the time at which the second camera begins. Without the camera's clock offset, people would be half a
        // metre apart.
        let truth = scene.joints(BEGIN_S[1] + instant / RATE_HZ);
        let head = &line["people"][0]["joints"]["head"]["position_m"];
        let head = [0, 1, 2].map(|axis| head[axis].as_f64().unwrap_or(f64::NAN));
        let off = (Point3::from(head) - Point3::from(truth[13])).norm();
        assert!(off < 0.08, "instant {instant}: {off} m");
    }
}

#[test]
fn footage_without_movement_is_refused_and_nothing_is_written() {
    let scene = scene();
    let rig = scene.rig();
    let still = case(&scene, rig, N_FRAMES, |_, _| 0.5);
    let before = std::fs::read_to_string(still.path("deployment.toml")).unwrap();
    estimate(&still, &["--window", "0.5", "--write"]).ends(7).says("not determined");
    let after = std::fs::read_to_string(still.path("deployment.toml")).unwrap();
    assert_eq!(before, after);
    for (arguments, code, words) in [
        (&["--window", "nan"][..], 2, "0.1 to 60"),
        (&["--reference", "nobody"], 2, "nobody"),
        (&["--set", "capture.frame_rate_hz=0"], 3, "frame_rate_hz"),
    ] {
        let ended = estimate(&still, arguments);
        assert_eq!(ended.status.code(), Some(code), "{}", ended.stderr);
        ended.says(words);
    }
    still.edit("deployment.toml", "\nname = \"c2\"", "\nname = \"c7\"");
    estimate(&still, &[]).ends(5).says("c7");
}

/// Writes a video with one picture every ten seconds, and with sounds that begin at some times. Without ffmpeg, returns false with a
/// message.
#[expect(clippy::print_stderr, reason = "a skipped test must say so")]
fn video(case: &Case, name: &str, sounds_s: &[f64], length_s: f64) -> bool {
    let mut samples = vec![0_i16; (length_s * 8000.0) as usize];
    for (nth, at_s) in sounds_s.iter().enumerate() {
        let mut random = fastrand::Rng::with_seed(nth as u64);
        let from = (at_s * 8000.0) as usize;
        for (since, sample) in samples.iter_mut().skip(from).take(900).enumerate() {
            let level = 9000.0 * (-(since as f64) / 200.0).exp();
            *sample = (level * (random.f64() - 0.5)) as i16;
        }
    }
    let bytes: Vec<u8> = samples.iter().flat_map(|sample| sample.to_le_bytes()).collect();
    case.write(&format!("{name}.raw"), bytes);
    let made = Command::new("ffmpeg")
        .args(["-nostdin", "-v", "error", "-f", "lavfi", "-i"])
        .arg(format!("testsrc=size=64x48:rate=25:duration={length_s}"))
        .args(["-f", "s16le", "-ar", "8000", "-ac", "1", "-i"])
        .arg(case.path(&format!("{name}.raw")))
        .arg(case.path(&format!("{name}.mp4")))
        .status();
    if made.is_err() {
        eprintln!("skipped: there is no ffmpeg on the PATH");
    }
    made.is_ok_and(|made| made.success())
}

#[test]
fn clock_offsets_are_estimated_from_the_sound_of_the_videos() {
    let scene = scene();
    let rig = scene.rig();
    let case = case(&scene, rig, N_FRAMES, |_, _| 0.5);
    let sounds_s = [2.1, 2.9, 4.4, 4.95, 6.3, 8.0, 8.45, 9.9];
    for (camera, begin_s) in rig.cameras().iter().zip(BEGIN_S) {
        let own: Vec<f64> = sounds_s.iter().map(|sounds_s| sounds_s - begin_s).collect();
        if !video(&case, &camera.name, &own, 11.0) {
            return;
        }
        let keypoints = format!("keypoints = {:?}", camera.name);
        let source = format!("source = \"{}.mp4\"", camera.name);
        case.edit(
            "deployment.toml",
            &keypoints,
            &format!("{source}\n{keypoints}"),
        );
    }
    let ended = estimate(
        &case,
        &["--by", "sound", "--out", "clocks.html", "--write", "--json"],
    )
    .ends(0);
    let found: Value = serde_json::from_str(&ended.stdout).unwrap();
    for (camera, begin_s) in found["cameras"].as_array().unwrap().iter().zip(BEGIN_S) {
        let off_ms = camera["offset_ms"].as_f64().unwrap() - 1e3 * (begin_s - BEGIN_S[0]);
        assert!(off_ms.abs() < 2.0, "{found:#}");
        assert_eq!(camera["joints"], 8, "{found:#}");
    }
    let page = std::fs::read_to_string(case.path("clocks.html")).unwrap();
    assert!(page.contains("beginnings of sounds"), "{page:.2000}");
    let text = std::fs::read_to_string(case.path("deployment.toml")).unwrap();
    assert_eq!(text.matches("offset_ms = ").count(), 3, "{text}");

    // One camera recorded only silence, the other has no microphone.
    video(&case, "quiet", &[], 11.0);
    case.edit("deployment.toml", "c2.mp4", "quiet.mp4");
    estimate(&case, &["--by", "sound"]).ends(7).says("c2: only 0 sounds begin");
    case.edit("deployment.toml", "source = \"quiet.mp4\"\n", "");
    estimate(&case, &["--by", "sound"])
        .ends(4)
        .says("\"c2\": the camera has no footage");
}
