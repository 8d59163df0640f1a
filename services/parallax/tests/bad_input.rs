//! Tests that errors in inputs name the file and the field, and that nothing is left behind.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

mod mistakes;
mod notices;
mod settings;

use std::fs;

use common::{Case, PLAIN, planted};
use image::DynamicImage;
use mistakes::{DRY, NOTHING, check, oops};
use serde_json::Value;

const RUN: &str = "run deployment.toml";
const DETECT: &str = "detect it.png --model model.plx --json";

#[test]
fn deployment_files() {
    check(
        (DRY, 4),
        &[
            oops(
                "unknown key",
                |fixture| fixture.edit("deployment.toml", "workers", "wrokers"),
                &["deployment.toml:21", "wrokers", "did you mean `workers`"],
                &[],
            )
            .with(DRY, 3),
            oops(
                "no such file",
                |fixture| fs::remove_file(fixture.path("deployment.toml")).unwrap(),
                &["deployment.toml", "No such file"],
                &[],
            ),
            oops(
                "frames of fewer than 40 pixels",
                |fixture| {
                    fixture.edit("deployment.toml", "upright", "size = [96, 39]\nupright");
                },
                &["view \"a\"", "96x39", "40"],
                &[],
            ),
        ],
    );
}

#[test]
fn footage() {
    check(
        (RUN, 4),
        &[
            oops(
                "empty first image",
                |fixture| fixture.write("b/0000.png", ""),
                &["b/0000.png", "0 bytes"],
                &[],
            ),
            oops(
                "images of one pixel",
                |fixture| {
                    for name in ["b/0000.png", "b/0001.png"] {
                        picture(1, 1).save(fixture.path(name)).unwrap();
                    }
                },
                &["camera \"b\"", "1x1", "calibrated for 96x128"],
                &[],
            )
            .with(DRY, 5),
        ],
    );
}

#[test]
fn an_image_of_another_size_is_named_and_affects_only_its_own_frame() {
    let case = Case::new("sizes", &[3; 2], PLAIN);
    picture(90, 128).save(case.path("b/0001.png")).unwrap();
    let ended = case.run();
    for word in ["b/0001.png", "90x128", "96x128"] {
        assert!(
            ended.stderr.contains(word),
            "lacks {word}: {}",
            ended.stderr
        );
    }
    assert_eq!(ended.status.code(), Some(7), "{}", ended.stderr);
    let missing = case.lines("pose3d.jsonl").into_iter();
    let missing: Vec<_> = missing.map(|missing| missing["views_missing"].clone()).collect();
    let none = serde_json::json!({});
    let expected = [none.clone(), serde_json::json!({ "b": "wrong size" }), none];
    assert_eq!(missing, expected, "the next frame is there again");
}

#[test]
fn models() {
    check(
        (DRY, 4),
        &[oops(
            "some other file",
            |fixture| {
                let picture = fs::read(fixture.path("a/0000.png")).unwrap();
                fixture.write("model.plx", picture);
            },
            &["model.plx is not a model", "PNG"],
            &[],
        )],
    );
}

#[test]
fn calibrations() {
    check(
        (DRY, 5),
        &[
            oops(
                "for another image size",
                |fixture| {
                    fixture.edit("rig.toml", "size_px = [96, 128]", "size_px = [128, 96]");
                },
                &[
                    "camera \"a\"",
                    "96x128",
                    "calibrated for 128x96",
                    "the sizes agree if the pictures are rotated",
                ],
                &[],
            ),
            oops(
                "without one of the cameras",
                |fixture| fixture.edit("deployment.toml", "name = \"b\"", "name = \"z\""),
                &["rig.toml", "no camera \"z\"", "a, b"],
                &[],
            )
            .with(RUN, 5),
            oops(
                "absent",
                |fixture| fs::remove_file(fixture.path("rig.toml")).unwrap(),
                &["rig.toml", "parallax calib convert"],
                &[],
            )
            .with(RUN, 4),
        ],
    );
}

#[test]
fn tables_of_expected_errors() {
    check(
        (DRY, 4),
        &[
            oops(
                "expected errors without one of the views",
                |fixture| {
                    fixture.edit(
                        "deployment.toml",
                        "workers = 2",
                        "workers = 2\nerrors = { table = \"q.csv\" }",
                    );
                    let parts: Vec<String> = (1..27).map(|part| format!("part_{part}")).collect();
                    let (parts, row) = (parts.join(","), ",1".repeat(26));
                    fixture.write(
                        "q.csv",
                        format!("frame,view,{parts}\n0,a{row}\n0,C2{row}\n"),
                    );
                },
                &["q.csv", "no rows for", "view `b`", "C2"],
                &[],
            ),
            oops(
                "a name for a camera that is not there",
                |fixture| {
                    let errors = "workers = 2\n\
                    errors = { table = \"q.csv\", views = { z = \"C1\" } }";
                    fixture.edit("deployment.toml", "workers = 2", errors);
                },
                &["paper.errors.views", "\"z\"", "[[camera]]"],
                &[],
            )
            .with(DRY, 3),
        ],
    );
}

#[test]
fn thresholds() {
    check(
        (DRY, 4),
        &[
            oops(
                "thresholds with a NaN",
                |fixture| {
                    let tau = "workers = 2\ntau = { file = \"tau.txt\" }";
                    fixture.edit("deployment.toml", "workers = 2", tau);
                    fixture.write("tau.txt", "1 2\n3 nan");
                },
                &["tau.txt: line 2", "`nan`"],
                &[],
            ),
            oops(
                "thresholds of a model of other parts",
                |fixture| {
                    fixture.edit(
                        "deployment.toml",
                        "workers = 2",
                        "workers = 2\ntau = [1, 2]",
                    );
                },
                &["`paper.tau` has 2 thresholds", "26 parts"],
                &[],
            )
            .with(DRY, 3),
        ],
    );
}

#[test]
fn part_type_tables() {
    check(
        (DRY, 4),
        &[oops(
            "part-type table with a NaN",
            |fixture| {
                let tables = "workers = 2\n[[paper.compatibility]]\nviews = [\"a\", \"b\"]\n\
                              files = [\"ab.csv\", \"ba.csv\"]";
                fixture.edit("deployment.toml", "workers = 2", tables);
                let rows: Vec<String> =
                    (2..54).map(|row| format!("{},0.5,0.5\n", row / 2)).collect();
                let rows = rows.concat();
                fixture.write("ab.csv", &rows);
                fixture.write("ba.csv", rows.replacen("2,0.5,0.5", "2,NaN,0.5", 1));
            },
            &["ba.csv: line 3, column 2", "`NaN`"],
            &[],
        )],
    );
}

#[test]
fn single_images() {
    check(
        (DETECT, 4),
        &[
            oops("absent", NOTHING, &["no such footage", "it.png"], &[]),
            oops(
                "0 bytes",
                |fixture| fixture.write("it.png", ""),
                &["it.png", "0 bytes"],
                &[],
            ),
            oops(
                "39 pixels high",
                |fixture| picture(96, 39).save(fixture.path("it.png")).unwrap(),
                &["it.png", "96x39", "40"],
                &[],
            ),
        ],
    );
}

#[test]
fn every_pixel_format_works() {
    let case = Case::new("kinds", &[1; 2], PLAIN);
    let rgb = picture(96, 128);
    let kinds = [
        ("rgb.png", rgb.clone()),
        ("rgba.png", rgb.to_rgba8().into()),
        ("grey.png", rgb.to_luma8().into()),
        (
            "grey-as-rgb.png",
            DynamicImage::from(rgb.to_luma8()).to_rgb8().into(),
        ),
        ("sixteen.png", rgb.to_rgb16().into()),
        (
            "smallest.png",
            rgb.resize_exact(40, 40, image::imageops::Nearest),
        ),
    ];
    let found = kinds.map(|(name, image)| {
        image.save(case.path(name)).unwrap();
        let ended = case.start(&["detect", name, "--model", "model.plx", "--json"]).wait();
        assert_eq!(ended.status.code(), Some(0), "{name}: {}", ended.stderr);
        let mut line: Value = serde_json::from_str(&ended.stdout).unwrap();
        line["detections"].take()
    });
    assert!(
        found[0][0]["score"].is_number(),
        "nothing is found: {}",
        found[0]
    );
    assert_eq!(found[1], found[0], "alpha");
    assert_eq!(found[2], found[3], "grey");
    assert_eq!(found[4], found[0], "sixteen bits");
}

/// Returns a test picture with another size.
fn picture(width: u32, height: u32) -> DynamicImage {
    let [w, h] = planted::SIZE;
    let canvas = planted::picture(&planted::rig(2).cameras()[0], 0);
    let image = image::RgbImage::from_raw(w, h, canvas.rgb().to_vec()).unwrap();
    DynamicImage::from(image).resize_exact(width, height, image::imageops::Nearest)
}

/// Replaces the first line of the rig that starts with a key.
fn replace_line(case: &Case, key: &str, line: &str) {
    let text = fs::read_to_string(case.path("rig.toml")).unwrap();
    let old = text.lines().find(|line| line.starts_with(key)).unwrap();
    case.write("rig.toml", text.replacen(old, line, 1));
}
