//! Tests of detectors of people, shown with their cards, and used by `detect` to find boxes.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use common::{Case, Ended, PLAIN};
use inference::onnx::{Network, Side};
use serde_json::{Value, json};

const CARD: &str = r#"
format = "parallax-detector"
version = 1
name = "Three boxes always"
licence = "CC0"
input = { width = 64, height = 64 }
output = { codec = "list", boxes = "dets" }
"#;

/// Boxes of the detector: left, top, right and bottom in pixels of its input, and the score.
const BOXES: [[f32; 5]; 3] = [
    [0.0, 0.0, 24.0, 32.0, 0.6],
    [24.0, 16.0, 48.0, 48.0, 0.9],
    [30.0, 30.0, 40.0, 40.0, 0.1],
];

/// Returns a detector that finds the same boxes in every picture.
fn detector() -> Network {
    let mut net = Network::default();
    let picture = [1, 3, 64, 64].map(Side::Fixed).to_vec();
    net.inputs.push(("picture".to_owned(), picture));
    let n = BOXES.len();
    let dets = [1, n, 5].map(Side::Fixed).to_vec();
    net.outputs.push(("dets".to_owned(), dets));
    net.floats("boxes", &[1, 3, 5], BOXES.concat());
    net.node("Relu", &["boxes"], "dets", vec![]);
    net
}

/// Creates a case with a picture of 128 by 96 pixels with one white block, the networks and their cards.
fn case(name: &str) -> Case {
    let case = Case::new(name, &[1, 1], PLAIN);
    case.write("det.onnx", detector().file());
    case.write("card.toml", CARD);
    case.write("net.onnx", crate::networks::network("Relu").file());
    case.write("net.toml", crate::networks::CARD);
    let mut picture = image::RgbImage::new(128, 96);
    for (row, column) in (0..8).flat_map(|row| (0..8).map(move |i| (row, i))) {
        picture.put_pixel(64 + column, 48 + row, image::Rgb([255; 3]));
    }
    picture.save(case.path("people.png")).unwrap();
    case
}

fn run(case: &Case, arguments: &[&str], more: &[&str]) -> Ended {
    case.start(&[arguments, more].concat()).wait()
}

fn parsed(ended: &Ended) -> Value {
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    serde_json::from_str(ended.stdout.trim()).unwrap()
}

/// Returns a box of the detector in pixels of the picture, which is twice as large as its input.
fn in_picture(nth: usize) -> Value {
    let side = |value: f32| (f64::from(value) + 0.5) * 2.0 - 0.5;
    json!(BOXES[nth][..4].iter().map(|bounds| side(*bounds)).collect::<Vec<_>>())
}

const DETECT: [&str; 6] = [
    "detect",
    "people.png",
    "--network",
    "net.onnx",
    "--detector",
    "det.onnx",
];

#[test]
fn the_network_searches_every_box_of_the_detector() {
    let case = case("detector-boxes");
    let card = ["--detector-card", "card.toml"];
    let line = parsed(&run(&case, &DETECT, &[&card[..], &["--json"]].concat()));
    assert_eq!(line["detector"], "det.onnx", "{line}");
    assert!(line["searched"].is_null(), "{line}");
    let found = line["detections"].as_array().unwrap();
    assert_eq!(found.len(), 2, "the third is below the least score: {line}");
    for (person, nth) in found.iter().zip([1, 0]) {
        assert_eq!(person["box"], in_picture(nth), "the surest first: {line}");
        assert_eq!(person["box_from"], "detector");
        let score = person["box_score"].as_f64().unwrap();
        assert!((score - f64::from(BOXES[nth][4])).abs() < 1e-6, "{person}");
    }
    // The block is inside the first box, and in a corner of the second.
    let head = |nth: usize| found[nth]["keypoints"][0]["score"].as_f64().unwrap();
    assert!(head(0) > 0.9, "{line}");

    let more = ["--max", "1", "--overlay", "drawn"];
    let ended = run(&case, &DETECT, &[&card[..], &more].concat()).ends(0);
    for words in [
        "1 detection by the network; boxes by Three boxes always",
        "of score 0.90",
    ] {
        assert!(ended.stdout.contains(words), "{words}: {}", ended.stdout);
    }
    assert!(case.path("drawn/people.png").is_file());
}

#[test]
fn a_card_is_found_beside_the_detector_or_inside_its_file() {
    let case = case("detector-card");
    let ended = run(&case, &DETECT, &[]).ends(4);
    for words in ["det.onnx: this detector has no card", "--detector-card"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
    let mut net = detector();
    let entry = |text: &str| ("parallax.card".to_owned(), text.to_owned());
    net.metadata.push(entry(CARD));
    case.write("det.onnx", net.file());
    assert_eq!(run(&case, &DETECT, &[]).status.code(), Some(0));
    let shown = parsed(&run(&case, &["model", "show", "det.onnx", "--json"], &[]));
    let card = &shown["detector_card"];
    assert_eq!(card["from"], "`parallax.card` in the file", "{shown}");
    case.write("det.onnx.toml", CARD.replace("Three", "Few"));
    let shown = parsed(&run(&case, &["model", "show", "det.onnx", "--json"], &[]));
    assert_eq!(shown["detector_card"]["name"], "Few boxes always");
    std::fs::remove_file(case.path("det.onnx.toml")).unwrap();
    net.metadata.push(entry(&CARD.replace("[64", "").replace("width", "wide")));
    case.write("det.onnx", net.file());
    let ended = run(&case, &DETECT, &[]).ends(4);
    for words in ["det.onnx: `parallax.card`", "wide"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
}

#[test]
fn a_detector_that_finds_nobody_prints_the_expected_input_of_its_card() {
    let case = case("detector-nobody");
    case.write("det.toml", format!("least_score = 0.95{CARD}"));
    let ended = run(&case, &DETECT, &[]).ends(0);
    assert!(ended.stdout.contains("0 detections"), "{}", ended.stdout);
    for words in ["finds nobody", "`least_score` = 0.95", "--box"] {
        assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
    }
    let shown = [
        "model",
        "show",
        "det.onnx",
        "--image",
        "people.png",
        "--out",
        "x.png",
    ];
    let ended = run(&case, &shown, &[]);
    let said = "finds nobody: no box has a score of 0.95 or more";
    assert!(ended.stdout.contains(said), "{}", ended.stdout);
}

#[test]
fn a_detector_is_explained_by_its_card_and_its_boxes_are_drawn() {
    let case = case("detector-shown");
    let show = ["model", "show", "det.onnx", "--card", "card.toml"];
    let look = ["--image", "people.png", "--out", "boxes.png"];
    let ended = run(&case, &show, &look).ends(0);
    for words in [
        "det.onnx: a detector of people",
        "`picture` [1, 3, 64, 64]",
        "`dets` [1, 3, 5]",
        "card.toml: Three boxes always",
        "64 wide, 64 high, rgb, planes, f32",
        "the rest is filled with 114",
        "`dets`, a list of boxes",
        "a score of at least 0.3",
        "licence CC0",
        "fits its card",
        "box (   48.5,    32.5) to (   96.5,    96.5)  0.90",
    ] {
        assert!(ended.stdout.contains(words), "{words}: {}", ended.stdout);
    }
    let drawn = image::open(case.path("boxes.png")).unwrap().to_rgb8();
    assert_eq!(drawn.dimensions(), (128, 96));
    assert_ne!(
        drawn.get_pixel(70, 32),
        &image::Rgb([0; 3]),
        "the upper side"
    );
    let shown = parsed(&run(&case, &show, &[&look[..], &["--json"]].concat()));
    assert_eq!(shown["boxes"][0]["box"], in_picture(1), "{shown}");
    assert_eq!(shown["boxes"].as_array().unwrap().len(), 2);
    assert!(shown["misfit"].is_null(), "{shown}");
    let boxed = [&look[..], &["--box", "0,0,9,9"]].concat();
    run(&case, &show, &boxed).ends(2);

    let shown = parsed(&run(&case, &["model", "show", "det.onnx", "--json"], &[]));
    assert_eq!(shown["nearest_detector_cards"], json!(["rtmdet-person"]));
}

#[test]
fn a_detector_that_does_not_match_its_card_is_refused_with_the_numbers() {
    let case = case("detector-misfit");
    let grids = ("codec = \"list\", boxes = \"dets\"", "codec = \"yolox\"");
    for ((from, to), words) in [
        (
            ("width = 64", "width = 96"),
            &["[1, 3, 64, 64]", "[1, 3, 64, 96]"][..],
        ),
        (("\"dets\"", "\"boxes\""), &["`boxes`", "`dets` [1, 3, 5]"]),
        (grids, &["`dets`", "[1, 3, 5]", "[1, 84, 6 or more]"]),
        (("version = 1", "version = 2"), &["wrong.toml", "version 2"]),
        (
            ("name =", "least_score = 7\nname ="),
            &["wrong.toml", "`least_score` is 7"],
        ),
        (("-detector", "-keypoint-network"), &["wrong.toml"]),
    ] {
        case.write("wrong.toml", CARD.replace(from, to));
        let detect = run(&case, &DETECT, &["--detector-card", "wrong.toml"]);
        let show = ["model", "show", "det.onnx", "--card", "wrong.toml"];
        for ended in [detect, run(&case, &show, &[])] {
            assert_eq!(ended.status.code(), Some(4), "{to}: {}", ended.stderr);
            for words in words {
                assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
            }
        }
    }
    // The card belongs to a network that finds keypoints.
    let ended = run(&case, &DETECT, &["--detector-card", "net.toml"]).ends(4);
    let said = "`parallax-keypoint-network` version 1, expected `parallax-detector` version 1";
    ended.says(said);
    // Options that cannot be combined with a detector.
    for more in [
        &["--threshold", "0"][..],
        &["--box", "0,0,9,9"],
        &["--full"],
    ] {
        let ended = run(
            &case,
            &DETECT,
            &[&["--detector-card", "card.toml"], more].concat(),
        );
        assert_eq!(ended.status.code(), Some(2), "{more:?}: {}", ended.stderr);
    }
    let filters = ["--detector", "det.onnx", "--network", "none"];
    run(&case, &["detect", "people.png"], &filters).ends(2);
}

#[test]
fn a_card_with_another_number_type_than_the_detector_is_refused() {
    let case = case("detector-numbers");
    let net = common::networks::detector_of([8.0, 8.0, 40.0, 40.0], 0.9);
    case.write("det.onnx", net.file());
    case.write("det.toml", CARD);
    let show = ["model", "show", "det.onnx"];
    assert_eq!(run(&case, &show, &[]).status.code(), Some(0));
    // The detector takes single-precision numbers, so bytes are refused.
    case.write(
        "det.toml",
        CARD.replace("height = 64", "height = 64, numbers = \"u8\""),
    );
    let ended = run(&case, &show, &[]);
    assert_eq!(ended.status.code(), Some(4), "{}", ended.stdout);
    let said = "det.onnx does not match its card (det.toml)";
    ended.says(said);
}
