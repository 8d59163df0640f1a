//! Tests with networks that the tests create.

use std::fs;

use inference::Session;
use inference::onnx::{Network, Side};

use super::*;
use crate::cards::{CardPlace, METADATA_KEY};
use crate::described::Described;

const CARD: &str = r#"
format = "parallax-keypoint-network"
version = 1
name = "NAME"
[input]
width = 12
height = 16
[output]
codec = "heat-map"
[keypoints]
names = ["head top", "neck", "left hip"]
"#;

/// Returns a network that outputs its input: three maps.
fn network() -> Network {
    let mut net = Network::default();
    let sides = [1, 3, 16, 12].map(Side::Fixed).to_vec();
    net.inputs.push(("picture".to_owned(), sides.clone()));
    net.outputs.push(("maps".to_owned(), sides));
    net.node("Relu", &["picture"], "maps", vec![]);
    net
}

#[test]
fn a_card_is_found_beside_the_network_or_in_it_or_at_the_given_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("net.onnx");
    let mut net = network();
    net.metadata.push((METADATA_KEY.to_owned(), CARD.replace("NAME", "inside")));
    fs::write(&path, net.file()).unwrap();
    let found = |given: Option<&Path>| {
        let file = NetworkFile::open(&path, given).unwrap();
        let (card, place) = file.card().unwrap().clone();
        (card.name, place)
    };
    assert_eq!(found(None), ("inside".to_owned(), CardPlace::Metadata));
    for name in ["net.onnx.toml", "net.toml", "other.toml"] {
        let card = folder.path().join(name);
        fs::write(&card, CARD.replace("NAME", name)).unwrap();
        let given = (name == "other.toml").then_some(card.as_path());
        assert_eq!(
            found(given),
            (name.to_owned(), CardPlace::File(card.clone()))
        );
    }
    let fitted = NetworkFile::open(&path, None).unwrap().fitted().unwrap();
    assert_eq!(fitted.card().name, "net.toml");
}

#[test]
fn a_truncated_network_and_one_without_a_card_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("net.onnx");
    let bytes = network().file();
    fs::write(&path, &bytes).unwrap();
    let file = NetworkFile::open(&path, None).unwrap();
    assert!(file.card().is_none());
    let refused = file.fitted().unwrap_err();
    assert!(refused.to_string().contains("has no card"), "{refused}");
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let refused = NetworkFile::open(&path, None).unwrap_err();
    assert!(refused.to_string().contains("truncated"), "{refused}");
    fs::write(&path, &bytes).unwrap();
    let card = folder.path().join("card.toml");
    fs::write(&card, CARD.replace("width = 12", "width = 24")).unwrap();
    let file = NetworkFile::open(&path, Some(&card)).unwrap();
    let refused = file.fitted().unwrap_err().to_string();
    assert!(
        refused.contains("[1, 3, 16, 12]") && refused.contains("[1, 3, 16, 24]"),
        "{refused}"
    );
    fs::write(&card, CARD.replace("width", "wide")).unwrap();
    let refused = NetworkFile::open(&path, Some(&card)).unwrap_err().to_string();
    assert!(
        refused.contains("card.toml") && refused.contains("wide"),
        "{refused}"
    );
}

#[test]
fn the_nearest_card_has_the_input_size_of_the_network() {
    let near = |inputs: &[usize], outputs: &[(&str, &[usize])]| {
        let mut net = Network::default();
        let sides = |sizes: &[usize]| sizes.iter().map(|n| Side::Fixed(*n)).collect::<Vec<_>>();
        net.inputs.push(("x".to_owned(), sides(inputs)));
        for (name, shape) in outputs {
            net.outputs.push(((*name).to_owned(), sides(shape)));
            net.floats(
                &format!("{name}0"),
                shape,
                vec![0.0; shape.iter().product()],
            );
            net.node("Relu", &[&format!("{name}0")], name, vec![]);
        }
        nearest(Session::parse(net.file()).unwrap().description())
    };
    let simcc = |n: usize| {
        near(
            &[1, 3, 256, 192],
            &[("simcc_x", &[1, n, 384]), ("simcc_y", &[1, n, 512])],
        )
    };
    assert_eq!(simcc(17), ["rtmpose-coco17"]);
    assert_eq!(simcc(26), ["rtmpose-halpe26"]);
    assert_eq!(
        near(&[1, 3, 256, 192], &[("y", &[1, 17, 64, 48])]),
        ["vitpose-s", "hrnet-w32", "pp-tinypose"]
    );
    assert_eq!(
        near(&[1, 192, 192, 3], &[("y", &[1, 1, 17, 3])]),
        ["movenet-lightning"]
    );
    assert_eq!(
        near(&[1, 256, 256, 3], &[("y", &[1, 195])]),
        ["blazepose-landmarks"]
    );
    // Maps of LSP's 14 joints and of the background match cards with either order of axes, but never a card for a list of positions.
    for (input, output) in [
        ([1, 3, 368, 368], [1, 15, 46, 46]),
        ([1, 368, 368, 3], [1, 46, 46, 15]),
        ([1, 192, 192, 3], [1, 96, 96, 14]),
        ([1, 3, 256, 256], [1, 14, 64, 64]),
    ] {
        assert_eq!(near(&input, &[("y", &output)]), ["cpm-lsp14"], "{output:?}");
    }
    assert!(near(&[1, 7], &[("y", &[1, 7])]).is_empty());
}

#[test]
fn the_card_says_whether_a_file_is_a_detector() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("net.onnx");
    fs::write(&path, network().file()).unwrap();
    let opened = |card: &str| {
        fs::write(path.with_extension("toml"), card).unwrap();
        Described::open(&path, None)
    };
    let it = opened(CARD).unwrap();
    assert!(matches!(it, Described::Network(it) if it.card().is_some()));
    let detector = r#"
format = "parallax-detector"
version = 1
name = "boxes"
input = { width = 12, height = 16 }
output = { codec = "yolox" }
"#;
    let Described::Detector(it) = opened(detector).unwrap() else {
        panic!("its card says that it is a detector");
    };
    assert_eq!(it.description().outputs[0].name, "maps");
    let refused = it.fitted().unwrap_err().to_string();
    assert!(
        refused.contains("net.toml") && refused.contains("expected [1, 2, 6 or more]"),
        "{refused}"
    );
    // For a file that is neither kind of card, the error names its format and version.
    let refused = opened("format = \"other\"\nversion = 1").unwrap_err();
    assert!(refused.to_string().contains("`other` version 1"));
}

#[test]
fn the_nearest_card_of_a_detector_has_its_kind_of_output() {
    let near = |input: usize, output: [usize; 3]| {
        let mut net = Network::default();
        let sides = [1, 3, input, input].map(Side::Fixed).to_vec();
        net.inputs.push(("x".to_owned(), sides));
        let sides = output.map(Side::Fixed).to_vec();
        net.outputs.push(("dets".to_owned(), sides));
        net.floats("boxes", &output, vec![0.0; output.iter().product()]);
        net.node("Relu", &["boxes"], "dets", vec![]);
        nearest_detectors(Session::parse(net.file()).unwrap().description())
    };
    // The grids have 8x8, 4x4 and 2x2 cells; the input on the card is larger.
    assert_eq!(near(64, [1, 84, 85]), ["yolox"]);
    assert!(near(96, [1, 84, 85]).is_empty());
    assert_eq!(near(320, [1, 100, 5]), ["rtmdet-person"]);
    assert!(near(320, [1, 17, 384]).is_empty());
}
