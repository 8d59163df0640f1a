//! Tests of networks that find keypoints: shown with their cards, and used in place of the filters.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use crate::common;

use common::started::signal;
use common::{Case, Ended, PLAIN};
use inference::onnx::{Attribute, Network, Side};
use serde_json::Value;

/// Number of columns and rows of the input.
const SIDES: [usize; 2] = [48, 64];

pub(crate) const CARD: &str = r#"
format = "parallax-keypoint-network"
version = 1
name = "Three colours"
licence = "CC0"
[input]
width = 48
height = 64
scale = 0.00392156862745098
[crop]
margin = 1.0
[output]
codec = "heat-map"
refine = "none"
[keypoints]
names = ["head top", "left hip", "right hip"]
"#;

/// Returns a network with three maps that have a quarter of the input's sides. `operator` computes the maps from the means of red, green
/// and blue.
pub(crate) fn network(operator: &str) -> Network {
    let mut net = Network::default();
    let [width, height] = SIDES;
    let sides = |n: usize| [1, 3, height / n, width / n].map(Side::Fixed).to_vec();
    net.inputs.push(("picture".to_owned(), sides(1)));
    net.outputs.push(("maps".to_owned(), sides(4)));
    let four = || Attribute::Ints(vec![4, 4]);
    let attributes = vec![("kernel_shape", four()), ("strides", four())];
    net.node("AveragePool", &["picture"], "means", attributes);
    net.node(operator, &["means"], "maps", vec![]);
    net
}

/// Creates a case with a network, its card, and a picture of 96 by 128 pixels with three coloured blocks.
fn case(name: &str) -> Case {
    let case = Case::new(name, &[1, 1], PLAIN);
    case.write("net.onnx", network("Relu").file());
    case.write("card.toml", CARD);
    let mut picture = image::RgbImage::new(96, 128);
    for (channel, [left, top]) in BLOCKS.into_iter().enumerate() {
        for (row, column) in (0..8).flat_map(|row| (0..8).map(move |i| (row, i))) {
            picture.get_pixel_mut(left + column, top + row).0[channel] = 255;
        }
    }
    picture.save(case.path("blocks.png")).unwrap();
    case
}

/// Top-left corners of the blocks. Each block fills one cell of a map.
const BLOCKS: [[u32; 2]; 3] = [[40, 8], [56, 64], [24, 72]];

fn run(case: &Case, arguments: &[&str]) -> Ended {
    case.start(arguments).wait()
}

fn json(ended: &Ended) -> Value {
    assert_eq!(ended.status.code(), Some(0), "{}", ended.stderr);
    serde_json::from_str(ended.stdout.trim()).unwrap()
}

#[test]
fn a_network_is_explained_by_its_card() {
    let case = case("network-shown");
    let ended = run(&case, &["model", "show", "net.onnx", "--card", "card.toml"]).ends(0);
    for words in [
        "`picture` [1, 3, 64, 48]",
        "`maps` [1, 3, 16, 12]",
        "Three colours",
        "joints 3 of 14",
        "missing: right ankle",
        "licence CC0",
        "fits its card",
    ] {
        assert!(ended.stdout.contains(words), "{words}: {}", ended.stdout);
    }
    let mut net = network("Relu");
    net.metadata.push(("parallax.card".to_owned(), CARD.to_owned()));
    case.write("inside.onnx", net.file());
    let shown = json(&run(&case, &["model", "show", "inside.onnx", "--json"]));
    assert_eq!(shown["card"]["name"], "Three colours", "{shown}");
    assert_eq!(shown["inputs"][0]["sides"][3], "48");
    assert!(shown["misfit"].is_null());
}

#[test]
fn the_error_for_a_missing_card_names_the_nearest_cards() {
    let case = case("network-bare");
    let mut net = network("Relu");
    net.inputs[0].1 = [1, 3, 256, 192].map(Side::Fixed).to_vec();
    net.outputs[0].1 = vec![
        Side::Fixed(1),
        Side::Fixed(17),
        Side::Named("h"),
        Side::Named("w"),
    ];
    case.write("bare.onnx", net.file());
    let ended = run(&case, &["model", "show", "bare.onnx"]).ends(0);
    for words in ["no card", "hrnet-w32.toml", "bare.toml", "docs/networks.md"] {
        assert!(ended.stdout.contains(words), "{words}: {}", ended.stdout);
    }
    let look = ["--image", "blocks.png", "--out", "seen.png"];
    run(
        &case,
        &[&["model", "show", "bare.onnx"], &look[..]].concat(),
    )
    .ends(4)
    .says("without a card");
    let shown = json(&run(&case, &["model", "show", "bare.onnx", "--json"]));
    assert!(shown["card"].is_null(), "{shown}");
    // All cards with this input are listed, because none has maps of three keypoints.
    let nearest = shown["nearest_cards"].as_array().unwrap();
    assert!(nearest.contains(&Value::from("vitpose-s")), "{shown}");
    run(&case, &["detect", "blocks.png", "--network", "bare.onnx"])
        .ends(4)
        .says("has no card");
}

#[test]
fn a_network_that_does_not_match_its_card_is_refused_with_the_numbers() {
    let case = case("network-misfit");
    for (from, to, words) in [
        ("width = 48", "width = 96", &["[1, 3, 64, 48]", "96"][..]),
        (
            "\"heat-map\"",
            "\"heat-map\"\nmaps = \"other\"",
            &["`other`", "`maps`"],
        ),
        (
            ", \"right hip\"",
            "",
            &["[1, 3, 16, 12]", "[1, 2, rows, columns]"],
        ),
        ("[crop]", "name = \"x\"\n[crop]", &["`x`", "`picture`"]),
        (
            "margin = 1.0",
            "margin = 9.0",
            &["wrong.toml", "crop.margin", "0.5 to 4"],
        ),
    ] {
        case.write("wrong.toml", CARD.replace(from, to));
        for arguments in [
            &["model", "show", "net.onnx", "--card", "wrong.toml"][..],
            &[
                "detect",
                "blocks.png",
                "--network",
                "net.onnx",
                "--card",
                "wrong.toml",
            ],
        ] {
            let ended = run(&case, arguments);
            assert_eq!(ended.status.code(), Some(4), "{from}: {}", ended.stderr);
            for words in words {
                assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
            }
        }
    }
}

#[test]
fn keypoints_in_a_box_are_found_in_the_right_place_and_drawn() {
    let case = case("network-detect");
    let plain = ["blocks.png", "--network", "net.onnx", "--card", "card.toml"];
    let boxed = [
        "--box",
        "0,0,96,128",
        "--overlay",
        "drawn",
        "--sheet",
        "sheet.png",
    ];
    let arguments = [&["detect", "--json"], &plain[..], &boxed].concat();
    let line = json(&run(&case, &arguments));
    let person = &line["detections"][0];
    assert_eq!(person["box_from"], "given", "{line}");
    for (keypoint, [left, top]) in BLOCKS.into_iter().enumerate() {
        let it = &person["keypoints"][keypoint];
        // The position is the first pixel of the cell. Two pixels of the picture are one pixel of the input.
        assert_eq!(it["x"], f64::from(left), "{it}");
        assert_eq!(it["y"], f64::from(top), "{it}");
        assert!(it["score"].as_f64().unwrap() > 0.6, "{it}");
    }
    assert_eq!(person["joints"]["head"][1], 8.0);
    assert!(person["joints"]["neck"].is_null());
    assert!(case.path("drawn/blocks.png").is_file() && case.path("sheet.png").is_file());

    let arguments = ["model", "show", "net.onnx", "--card", "card.toml", "--json"];
    let look = [
        "--image",
        "blocks.png",
        "--box",
        "0,0,96,128",
        "--out",
        "seen.png",
    ];
    let shown = json(&run(&case, &[&arguments[..], &look].concat()));
    assert_eq!(shown["keypoints"], person["keypoints"]);
    // The sheet shows the joints, and a map of each of the three.
    let sheet = image::open(case.path("seen.png")).unwrap();
    assert!(sheet.width() > 4 * 192, "{}", sheet.width());
}

#[test]
fn options_of_the_filters_are_refused_together_with_a_network() {
    let case = case("network-search");
    let detect = ["detect", "a/0000.png", "--network", "net.onnx"];
    for option in [
        ["--model", "model.plx"],
        ["--threshold", "0"],
        ["--size", "640"],
    ] {
        let ended = run(
            &case,
            &[&detect[..], &["--card", "card.toml"], &option].concat(),
        )
        .ends(2);
        let said = format!("{} is an option of the filters", option[0]);
        ended.says(&said);
    }
}

/// The main use of the shipped network: only a picture is given.
#[test]
fn the_included_network_finds_everybody_once_and_in_the_right_place() {
    let case = Case::new("net-ships", &[1, 1], PLAIN);
    let who = ["--rig", "ring:3", "--subjects", "901", "--seed", "77"];
    let one = ["--actions", "walking", "--frames", "1"];
    case.start(&[&["synth", "room"], &who[..], &one].concat()).wait().ends(0);
    let rig = case.path("room/rig.toml");
    let rig = geometry::files::read(&rig, &geometry::files::ReadOptions::default()).unwrap();
    let truth = std::fs::read_to_string(case.path("room/truth.jsonl")).unwrap();
    let mut truth = truth.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let names = truth.next().unwrap()["joints"].clone();
    let places = truth.next().unwrap()["joints"].clone();
    let named = |name: &str| {
        let number = names.as_array().unwrap().iter().position(|array| array == name);
        let at: Vec<f64> = serde_json::from_value(places[number.unwrap()].clone()).unwrap();
        nalgebra::Point3::new(at[0], at[1], at[2])
    };
    for camera in rig.cameras() {
        let picture = format!("room/cameras/{}/000000.png", camera.name);
        let line = json(&run(&case, &["detect", &picture, "--json"]));
        assert_eq!(line["network"], "shipped", "{line:#}");
        let found = line["detections"].as_array().unwrap();
        assert_eq!(found.len(), 1, "{line:#}");
        let distance = |joint: &str, of: &str| {
            let truth = camera.project(&named(of)).unwrap();
            let at: Vec<f64> = serde_json::from_value(found[0]["joints"][joint].clone()).unwrap();
            (at[0] - truth.x).hypot(at[1] - truth.y)
        };
        // One view may swap left and right.
        let off = |sides: [&str; 2]| {
            let joints = ["ankle", "knee", "hip", "shoulder", "elbow", "wrist"];
            let each = joints.iter().flat_map(|joint| {
                ["left", "right"]
                    .into_iter()
                    .zip(sides)
                    .map(move |(a, b)| distance(&format!("{a} {joint}"), &format!("{b} {joint}")))
            });
            let mut each: Vec<f64> = each.collect();
            each.sort_by(f64::total_cmp);
            each[6]
        };
        let off = off(["left", "right"]).min(off(["right", "left"]));
        assert!(off < 8.0, "{}: {off} pixels, {line:#}", camera.name);
    }
}

#[test]
fn a_network_is_judged_on_marked_people() {
    let case = case("network-judge");
    // The head and the hips are at the blocks, in the middle of cells of the maps. The other joints, which the network does not know, are
    // elsewhere.
    let mut marks = [[8.0, 120.0]; 14];
    for (joint, block) in [(13, 0), (3, 1), (2, 2)] {
        marks[joint] = BLOCKS[block].map(|block| f64::from(block) + 3.5);
    }
    let person = serde_json::json!({"image": "blocks.png", "joints": marks});
    case.write("people.jsonl", format!("{person}\n"));
    let judge = ["judge", "net.onnx", "people.jsonl"];
    let card = ["--card", "card.toml"];
    let report = json(&run(&case, &[&judge[..], &card, &["--json"]].concat()));
    assert_eq!(report["images"], 1, "{report}");
    let of = |which: &str, group: &str| report[which]["pck"]["0.2"][group].as_f64().unwrap();
    assert_eq!(of("peaks", "hip"), 100.0, "{report}");
    assert!(report["peaks"]["intervals"]["pck"]["0.2"][0].is_number());
    assert_eq!(of("peaks", "knee"), 0.0, "{report}");
    let expected = &report["expected_errors"];
    let [n, n_far] = ["joints", "off_by_half_a_head"].map(|name| expected[name].as_u64().unwrap());
    assert!(n > n_far && n <= 14, "{expected}");
    let ended = run(&case, &[&judge[..], &card].concat()).ends(0);
    assert!(ended.stdout.contains("in the person's box: 1 images"));
    run(&case, &[&judge[..], &card, &["--offsets"]].concat()).ends(2);
    run(
        &case,
        &[&["judge", "model.plx", "people.jsonl"], &card[..]].concat(),
    )
    .ends(2);
    run(&case, &judge).ends(4).says("has no card");
}

#[test]
fn an_interrupted_judge_command_ends_early() {
    let case = case("network-interrupted");
    // The first person has no marks and is left out. The message about this shows that judging has begun, which takes minutes.
    let mut marks = vec![[f64::NAN; 2]; 14];
    let line = |marks: &[[f64; 2]]| {
        let person = serde_json::json!({"image": "blocks.png", "joints": marks});
        format!("{person}\n")
    };
    let mut people = line(&marks);
    for nth in 0..20_000 {
        for (joint, it) in marks.iter_mut().enumerate() {
            let column = 5.0 + f64::from(nth) / 1000.0 + joint as f64;
            *it = [column, 20.0 + 5.0 * joint as f64];
        }
        people += &line(&marks);
    }
    case.write("people.jsonl", people);
    for model in [&["net.onnx", "--card", "card.toml"][..], &["model.plx"]] {
        let judge = [&["judge"], model, &["people.jsonl"]].concat();
        let mut started = case.start(&judge);
        started.until_said("left out");
        signal("INT", started.id());
        let ended = started.wait().ends(130);
        ended.says("interrupted");
        assert_eq!(ended.stdout, "", "no figures of a part");
    }
}

#[test]
fn a_truncated_network_and_one_without_numeric_output_are_refused() {
    let case = case("network-broken");
    let bytes = network("Relu").file();
    case.write("short.onnx", &bytes[..bytes.len() / 2]);
    // For a black picture, this network computes the logarithm of 0.
    case.write("log.onnx", network("Log").file());
    let with = |name: &str| {
        let card = ["--card", "card.toml"];
        run(
            &case,
            &[&["detect", "blocks.png", "--network", name], &card[..]].concat(),
        )
    };
    for (name, words) in [
        ("short.onnx", &["short.onnx", "truncated"]),
        ("log.onnx", &["`maps`", "inf"]),
        ("absent.onnx", &["absent.onnx", "No such file"]),
    ] {
        let ended = with(name).ends(4);
        for words in words {
            assert!(ended.stderr.contains(words), "{words}: {}", ended.stderr);
        }
    }
}

#[test]
fn network_options_are_refused_with_filters_and_filter_options_with_a_network() {
    let case = case("network-or-filters");
    let bring = ["--network", "net.onnx", "--card", "card.toml"];
    for (more, words) in [
        (&["--network", "none", "--box", "0,0,9,9"][..], "--box"),
        (&["--model", "model.plx", "--mirror"], "--mirror"),
        (&[&bring[..], &["--joints", "umpm15"]].concat(), "--joints"),
    ] {
        let ended = run(&case, &[&["detect", "blocks.png"], more].concat());
        assert_eq!(ended.status.code(), Some(2), "{more:?}: {}", ended.stderr);
        assert!(ended.stderr.contains(words), "{more:?}: {}", ended.stderr);
    }
    for more in [&["--network", "none"][..], &["--model", "model.plx"]] {
        let line = json(&run(
            &case,
            &[&["detect", "a/0000.png", "--json"], more].concat(),
        ));
        assert!(line["network"].is_null(), "{line}");
    }
}
