//! Tests of the size of searched frames if a deployment sets none, and of people who are too small or too large.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use core::fmt::Write as _;

use geometry::files::Format;
use geometry::{Camera, Intrinsics, Rig};
use nalgebra::Isometry3;
use serde_json::{Value, json};

use crate::common::{Case, PLAIN};

const DRY: &[&str] = &["run", "deployment.toml", "--dry-run"];

/// Writes cameras of the same kind, evenly around the stage, and a deployment with only the cameras, the rig and the output.
fn deployment(case: &Case, sizes: &[[u32; 2]], focal: f64, units_per_metre: f64) {
    let ring = scene::RigChoice::Ring {
        n: sizes.len(),
        radius: 4.0,
        height: 1.3,
    };
    let ring = ring.rig().unwrap();
    let cameras = ring.cameras().iter().zip(sizes).map(|(camera, size)| {
        let mut place: Isometry3<f64> = camera.camera_from_world;
        place.translation.vector *= units_per_metre;
        Camera {
            camera_from_world: place,
            intrinsics: Intrinsics {
                fx: focal,
                fy: focal,
                cx: f64::from(size[0]) / 2.0,
                cy: f64::from(size[1]) / 2.0,
                size: *size,
                ..camera.intrinsics
            },
            ..camera.clone()
        }
    });
    let rig = Rig::new(cameras.collect(), ring.up_in_world(), "planted").unwrap();
    geometry::files::write(&case.path("rig.toml"), Format::Own, &rig).unwrap();
    let mut text = format!(
        "name = \"{}\"\nrig = \"rig.toml\"\noutput = \"out\"\n",
        case.name
    );
    if units_per_metre > 1.0 {
        text.push_str("unit = \"mm\"\n");
    }
    for (camera, [width, height]) in rig.cameras().iter().zip(sizes) {
        let name = &camera.name;
        let file = format!("{name}.png");
        // Only the size of the picture matters.
        let size = footage::Size::new(*width as usize, *height as usize);
        let shade = 40 + 20 * u8::try_from(text.len() % 7).unwrap();
        footage::Canvas::new(size, [shade; 3]).save_png(&case.path(&file)).unwrap();
        write!(text, "\n[[camera]]\nname = {name:?}\nsource = {file:?}\n").unwrap();
    }
    case.write("deployment.toml", text);
}

fn said(case: &Case) -> String {
    let ended = case.start(DRY).wait().ends(0);
    let size = ended.stdout.lines().find(|line| line.starts_with("capture.scale"));
    size.unwrap().to_owned()
}

#[test]
fn by_default_the_size_follows_from_the_calibration_in_any_unit() {
    let case = Case::new("size-dry", &[1; 2], PLAIN);
    deployment(&case, &[[1088, 1920]; 4], 1800.0, 1.0);
    let text = said(&case);
    for words in [
        "is set automatically: 0.25, a person is 7",
        "px in 272x480; 4 cameras share the space in which a person of 1.70 m stands",
        "capture.scale or capture.size overrides this",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    deployment(&case, &[[1088, 1920]; 4], 1800.0, 1000.0);
    assert_eq!(said(&case), text, "the same calibration in millimetres");
    // A setting of the user takes precedence, without a message.
    for set in ["capture.scale=0.5", "capture.size=[544,960]"] {
        let ended = case.start(&[DRY, &["--set", set]].concat()).wait().ends(0);
        assert!(
            !ended.stdout.contains("scale is set automatically"),
            "{}",
            ended.stdout
        );
    }
}

#[test]
fn cameras_of_different_sizes_are_distinguished_and_small_people_give_a_warning() {
    let case = Case::new("size-mixed", &[1; 2], PLAIN);
    deployment(&case, &[[1920, 1080], [640, 480], [1920, 1080]], 700.0, 1.0);
    let text = said(&case);
    for words in [
        ": 0.3333 for c1, c3, a person is ",
        " px in 640x360; 0.75 for c2, a person is ",
        " px in 480x360; 3 cameras share",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    deployment(&case, &[[1920, 1080]; 3], 420.0, 1.0);
    let ended = case.start(DRY).wait();
    let words = "a person is about ";
    assert!(
        ended.stderr.contains(words) && ended.stderr.contains("set capture.scale = "),
        "{}",
        ended.stderr
    );
}

/// Returns the summary as JSON and as text.
fn run(case: &Case, more: &[&str]) -> (Value, String) {
    let summary = |arguments: &[&str]| {
        let ended = case.start(&[&["run", "deployment.toml"], more, arguments].concat()).wait();
        case.assert_nothing_left();
        assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
        ended.stdout
    };
    (
        serde_json::from_str(&summary(&["--json"])).unwrap(),
        summary(&[]),
    )
}

/// Returns the median height of a view's person over the three frames of `pose2d.jsonl`, in pixels.
fn height_in_results(case: &Case, view: &str) -> f64 {
    let lines = case.lines("pose2d.jsonl");
    let of_view = lines.iter().filter(|line| line["view"] == view);
    let mut heights: Vec<f64> = of_view.map(|value| side(&value["fused"]["parts"])).collect();
    heights.sort_by(f64::total_cmp);
    assert_eq!(heights.len(), 3);
    heights[1]
}

/// Returns the longer side of the rectangle around parts.
fn side(parts: &Value) -> f64 {
    let parts = parts.as_array().unwrap();
    let extent = |axis: &str| {
        let values = parts.iter().map(|part| part[axis].as_f64().unwrap());
        let most = values.clone().fold(f64::MIN, f64::max);
        most - values.fold(f64::MAX, f64::min)
    };
    extent("x").max(extent("y"))
}

#[test]
fn a_run_warns_about_small_people_and_names_the_setting_to_change() {
    // The pictures have 96x128 pixels.
    let case = Case::new("size-small", &[3; 2], PLAIN);
    let (json, text) = run(&case, &[]);
    assert_eq!(
        json["search_size"]["by_itself"]["cameras"][0]["scale"],
        json!(1.0)
    );
    let outside = &json["search_size"]["outside"];
    assert_eq!(outside["views"].as_array().unwrap().len(), 2, "{outside}");
    let px = outside["views"][0][1].as_f64().unwrap();
    assert!((px - height_in_results(&case, "a")).abs() <= 0.5, "{px}");
    assert_eq!(json["recorded"]["summary"]["person_px"]["a"], json!(px));
    let scale = outside["scale"].as_f64().unwrap();
    assert!((1.0..=2.0).contains(&scale), "{scale}");
    let advice = format!("(110 to 350 px are best for the search): set capture.scale = {scale}");
    assert!(text.contains(&advice), "{text}");

    let (json, text) = run(&case, &["--set", "capture.size=[96,128]"]);
    assert_eq!(json["search_size"]["by_itself"], Value::Null);
    assert_eq!(json["search_size"]["outside"]["has_size"], json!(true));
    assert!(text.contains(" in place of capture.size"), "{text}");
}
