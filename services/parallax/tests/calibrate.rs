//! Tests of rigs from people, from rendered pictures to the rig file.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::Path;

use geometry::Rig;
use geometry::files::ReadOptions;

use crate::common::Case;
use crate::sync;

fn rig(path: &Path) -> Rig {
    geometry::files::read(path, &ReadOptions::default()).unwrap()
}

#[test]
fn the_floor_is_found_from_a_walking_person_and_not_used_with_another_rig() {
    let scene = sync::scene();
    let case = sync::case(&scene, scene.rig(), 400, |_, frame| {
        frame as f64 / sync::RATE_HZ
    });
    case.start(&["run", "deployment.toml"]).wait().ends(0);
    let origin = |rig: &str| {
        let words = [
            "calibrate",
            "origin",
            rig,
            "--people",
            "out",
            "--out",
            "room.toml",
        ];
        case.start(&words).wait()
    };
    origin("rig.toml").ends(0);
    let (found, truth) = (rig(&case.path("room.toml")), rig(&case.path("rig.toml")));
    for (found, truth) in found.cameras().iter().zip(truth.cameras()) {
        // The floor of the scene is at z = 0.
        let off = found.centre_in_world().z - truth.centre_in_world().z;
        assert!(off.abs() < 0.05, "{}: {off} m", found.name);
    }
    // The run was made before the origin of the rig was moved to the floor.
    case.edit(
        "rig.toml",
        "translation_metres = [0.0, ",
        "translation_metres = [1.5, ",
    );
    origin("rig.toml").ends(7).says("does not belong to this rig");
}

#[test]
fn a_message_says_if_the_options_differ_from_the_existing_room() {
    let case = Case::new("new-kept", &[1, 1], "");
    let new =
        |camera: &str| case.start(&["new", "room", "--camera", camera, "--rig", "rig.toml"]).wait();
    let ended = new("nobody=a.mp4");
    assert!(!ended.status.success(), "{}", ended.stderr);
    let ended = new("nobody=a.mp4");
    ended.says("kept room/deployment.toml\n");
    let ended = new("somebody=a.mp4");
    ended.says("differs from the file that these options");
}

#[test]
fn a_room_is_calibrated_from_people_step_by_step() {
    let case = Case::new("new", &[1, 1], "");
    let cameras = ["--camera", "a=a.mp4", "--camera", "b=b.mp4"];
    let rig = ["--rig", "rig.toml"];
    let new = |more: &[&str]| {
        let words = [&["new", "room", "--dry-run"], &cameras[..], &rig, more].concat();
        case.start(&words).wait()
    };
    let ended = new(&["--people", "1.8", "--sync"]).ends(0);
    let lines = ended.stdout.lines();
    let steps: Vec<&str> = lines.filter(|line| line.starts_with("parallax")).collect();
    let people = "parallax calibrate people room/deployment.toml --set rig=lenses.toml --height-m 1.8 --out room/rig.toml \
                  --report room/rig.html --window 2";
    assert_eq!(
        steps[..2],
        [
            "parallax calib convert rig.toml --out room/lenses.toml",
            people
        ],
        "{steps:#?}"
    );
    assert!(!case.path("room").exists());
    let odd = [&["new", "room 1 #a", "--dry-run"], &cameras[..], &rig].concat();
    let ended = case.start(&odd).wait();
    let next = "next: parallax run 'room 1 #a/deployment.toml'";
    ended.says(next);
    new(&["--people", "18"]).ends(2).says("0.8 to 2.4 metres");
}

/// Tests that take long; `cargo test -- --ignored` runs them.
mod long {
    use calibration::differences;
    use geometry::Camera;
    use geometry::files::Format;
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::common::Started;

    /// Angle by which the second camera of the wrong rig is rotated, in degrees.
    const TURNED: f64 = 2.0;

    /// Writes the rig with the second camera rotated at its position.
    fn write_turned(case: &Case) {
        let truth = rig(&case.path("room/rig.toml"));
        let mut cameras: Vec<Camera> = truth.cameras().to_vec();
        let centre = cameras[1].centre_in_world();
        let by = UnitQuaternion::from_euler_angles(0.0, TURNED.to_radians(), 0.0);
        let pose = &mut cameras[1].camera_from_world;
        pose.rotation = by * pose.rotation;
        pose.translation = (-(pose.rotation * centre.coords)).into();
        let turned = Rig::new(cameras, truth.up_in_world(), "turned").unwrap();
        let path = case.path("room/turned.toml");
        geometry::files::write(&path, Format::Own, &turned).unwrap();
    }

    fn refine(case: &Case, deployment: &str, out: &str) -> Started {
        let file = format!("room/{deployment}.toml");
        let page = format!("{out}.html");
        case.start(&[
            "calibrate",
            "refine",
            &file,
            "--out",
            out,
            "--report",
            &page,
        ])
    }

    #[test]
    #[ignore = "takes long"]
    fn a_rotated_camera_is_corrected_and_a_correct_rig_is_kept() {
        let case = Case::new("calibrate", &[1, 1], "");
        let who = ["--rig", "ring:3", "--subjects", "5", "--seed", "5"];
        let long = ["--frames", "60", "--rate", "10", "--no-masks"];
        let words = [&["synth", "room"], &who[..], &long].concat();
        case.start(&words).wait().ends(0);
        write_turned(&case);
        let text = std::fs::read_to_string(case.path("room/deployment.toml")).unwrap();
        let text = text.replace("\"rig.toml\"", "\"turned.toml\"");
        case.write("room/wrong.toml", text);

        let right = refine(&case, "deployment", "right.toml");
        let wrong = refine(&case, "wrong", "better.toml");
        right.wait().ends(6).says("keep the old rig");
        assert!(!case.path("right.toml").exists());
        wrong.wait().ends(0);

        let truth = rig(&case.path("room/rig-exact.toml"));
        let worst = |file: &str| {
            let found = rig(&case.path(file));
            let apart = differences(found.cameras(), truth.cameras(), true);
            let turns = apart.iter().map(|apart| apart.turn.to_degrees());
            turns.fold(0.0, f64::max)
        };
        let [before, after] = [worst("room/turned.toml"), worst("better.toml")];
        assert!(before > 1.0 && after < 0.5 * before, "{before} {after}");
        let page = std::fs::read_to_string(case.path("better.toml.html")).unwrap();
        assert!(page.contains("The pictures that fit worst"));
        let pictures = page.matches("data:image/jpeg;base64,").count();
        assert_eq!(pictures, 6, "two of each camera");
    }
}
