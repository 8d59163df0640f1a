//! Tests with photographs and clips like those of users: some are large, some have an orientation tag, and some are damaged.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(clippy::print_stderr, reason = "a test that cannot run says so")]

use crate::common;

use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::process::Command;

use common::{Case, Ended, PLAIN};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{DynamicImage, imageops};
use serde_json::Value;

/// Creates a case with the pictures of one camera in the folder `a`.
fn case(name: &str, n_frames: usize) -> (Case, DynamicImage) {
    let case = Case::new(name, &[n_frames, 1], PLAIN);
    let picture = image::open(case.path("a/0000.png")).unwrap();
    (case, picture)
}

fn detect(case: &Case, more: &[&str]) -> (Ended, Vec<Value>) {
    let plain = ["detect", "--model", "model.plx", "--json"];
    let ended = case.start(&[&plain, more].concat()).wait();
    let lines = ended.stdout.lines();
    let lines = lines.map(|line| serde_json::from_str(line).unwrap()).collect();
    (ended, lines)
}

#[test]
fn a_damaged_file_is_named_and_the_other_files_are_searched() {
    let (case, picture) = case("detect-broken", 3);
    let mut jpeg = Cursor::new(Vec::new());
    picture.to_rgb8().write_to(&mut jpeg, image::ImageFormat::Jpeg).unwrap();
    case.write("a/0001.jpg", &jpeg.get_ref()[..700]);
    case.write("a/0002.bmp", "");
    let (ended, lines) = detect(&case, &["a", "absent.png"]);
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let images = lines.iter().map(|line| line["image"].as_str().unwrap());
    let images: Vec<_> = images.collect();
    assert_eq!(images, ["a/0000.png", "a/0001.png", "a/0002.png"]);
    for words in ["0001.jpg", "0002.bmp", "absent.png", "3 of 6 files"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
    // If no file can be read, this is an input error.
    for files in [&["a/0001.jpg"][..], &["a/0001.jpg", "absent.png"]] {
        let (ended, lines) = detect(&case, files);
        assert_eq!(
            (ended.status.code(), lines.len()),
            (Some(4), 0),
            "{}",
            ended.stderr
        );
    }
}

#[test]
fn a_picture_is_searched_with_its_orientation_tag_applied() {
    let (case, picture) = case("detect-turned", 1);
    let stored = imageops::rotate270(&picture.to_rgb8());
    let mut png = Vec::new();
    stored.write_with_encoder(PngEncoder::new(&mut png)).unwrap();
    let mut jpeg = Vec::new();
    stored
        .write_with_encoder(JpegEncoder::new_with_quality(&mut jpeg, 100))
        .unwrap();
    // The tag asks for a rotation by 90 degrees to the right.
    for (name, file) in [("turned.png", png), ("turned.jpg", jpeg)] {
        case.write(name, testkit::exif::tagged(&file, 6));
    }
    let files = ["a/0000.png", "turned.png", "turned.jpg"];
    let (ended, lines) = detect(&case, &[&files[..], &["--overlay", "drawn"]].concat());
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    for line in &lines {
        assert_eq!([&line["width"], &line["height"]], [96, 128], "{line}");
    }
    assert!(
        lines[0]["detections"][0]["score"].is_number(),
        "{}",
        lines[0]
    );
    assert_eq!(lines[1]["detections"], lines[0]["detections"]);
    let drawn = |name: &str| image::open(case.path("drawn").join(name)).unwrap();
    assert_eq!(drawn("turned.png").width(), 96);
    for by in [["--model", "model.plx"], ["--box", "0,0,90,120"]] {
        let ended = case.start(&[&["detect", "turned.png"], &by[..]].concat()).wait();
        let said = "90 degrees to the right";
        assert!(ended.stdout.contains(said), "{by:?}: {}", ended.stdout);
    }

    // The camera was calibrated with the upright picture, so a deployment applies the tag and reports this.
    fs::copy(case.path("turned.png"), case.path("a/0000.png")).unwrap();
    let ended = case.start(&["run", "deployment.toml", "--dry-run"]).wait();
    for words in ["orientation tag", "camera \"a\"", "is applied"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
}

#[test]
fn a_large_picture_is_searched_at_a_reported_smaller_size() {
    let (case, picture) = case("detect-large", 1);
    let large = imageops::resize(&picture.to_rgb8(), 384, 512, imageops::FilterType::Nearest);
    large.save(case.path("large.png")).unwrap();
    let files = ["large.png", "a/0000.png", "--size", "128"];
    let (ended, lines) = detect(&case, &files);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let [large, small] = &lines[..] else {
        panic!("{lines:?}");
    };
    assert_eq!([&large["width"], &large["height"]], [384, 512]);
    assert_eq!(large["searched"], small["searched"]);
    let best = |value: &Value| value["detections"][0].clone();
    let (large, small) = (best(large), best(small));
    assert_eq!(large["score"], small["score"], "four pixels are one again");
    let number = |value: &Value| value.as_f64().unwrap();
    for (large, small) in [
        (&large["parts"][3]["x"], &small["parts"][3]["x"]),
        (&large["parts"][7]["box"][3], &small["parts"][7]["box"][3]),
        (&large["joints"]["head"][1], &small["joints"]["head"][1]),
    ] {
        let expected = 4.0 * (number(small) + 0.5) - 0.5;
        assert!((number(large) - expected).abs() < 1e-9, "{large} {small}");
    }
    assert_eq!(number(&large["scale"]), 4.0 * number(&small["scale"]));
    let plain = ["detect", "large.png", "--model", "model.plx"];
    let ended = case.start(&[&plain[..], &["--size", "128"]].concat()).wait();
    let said = "searched at 96x128 instead of 384x512";
    assert!(ended.stdout.contains(said), "{}", ended.stdout);
    let ended = case.start(&[&plain[..], &["--full"]].concat()).wait();
    assert!(!ended.stdout.contains("searched at"), "{}", ended.stdout);
}

#[test]
fn a_video_is_searched_frame_by_frame() {
    let (case, _) = case("detect-video", 5);
    let clip = case.path("clip.mp4");
    if !made(&case.path("a/%04d.png"), &clip) {
        eprintln!("skipped: no ffmpeg that writes a video");
        return;
    }
    let more = [
        "clip.mp4",
        "--every",
        "2",
        "--overlay",
        "drawn",
        "--sheet",
        "sheet.png",
    ];
    let (ended, lines) = detect(&case, &more);
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    let frames: Vec<_> = lines.iter().map(|line| line["frame"].as_u64()).collect();
    assert_eq!(frames, [Some(0), Some(2), Some(4)]);
    for frame in [0, 2, 4] {
        assert!(
            case.path(&format!("drawn/clip-{frame:06}.png")).is_file(),
            "{frame}"
        );
    }
    assert!(case.path("sheet.png").is_file());
    let (_, lines) = detect(&case, &["clip.mp4", "--frames", "2"]);
    assert_eq!(lines.len(), 2);
}

fn made(pattern: &Path, clip: &Path) -> bool {
    let pictures = ["-v", "error", "-framerate", "10", "-i"];
    let mut command = Command::new("ffmpeg");
    command.args(pictures).arg(pattern).arg(clip);
    command.status().is_ok_and(|status| status.success())
}
