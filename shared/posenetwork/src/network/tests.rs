//! Tests with small networks that are made here, and with cards that match or do not match them.

use inference::onnx::{Attribute, Network, Side};

use super::*;
use crate::maps::{JointMaps, MapSettings};

pub(super) const CARD: &str = r#"
format = "parallax-keypoint-network"
version = 1
name = "three colours"
[input]
width = 12
height = 16
[crop]
margin = 1.0
[output]
codec = "heat-map"
refine = "none"
[keypoints]
names = ["a", "b", "c"]
"#;

pub(super) fn sides(sides: &[usize]) -> Vec<Side> {
    sides.iter().map(|side| Side::Fixed(*side)).collect()
}

/// Makes a network that returns `operator` of its input as three maps.
pub(super) fn network(operator: &str) -> Network {
    let mut net = Network::default();
    net.inputs.push(("picture".to_owned(), sides(&[1, 3, 16, 12])));
    net.outputs.push(("maps".to_owned(), sides(&[1, 3, 16, 12])));
    net.node(operator, &["picture"], "maps", vec![]);
    net
}

pub(super) fn fitted(net: &Network, card: &str) -> Result<PoseNetwork, FitError> {
    let session = Session::parse(net.file()).unwrap();
    PoseNetwork::new(session, Card::parse(card).unwrap())
}

/// Returns the message for a network that does not match its card.
fn refused(net: &Network, card: &str) -> String {
    fitted(net, card).unwrap_err().to_string()
}

/// Runs the network on a black picture of the input's size with some white pixels.
fn keypoints(net: &Network, card: &str, white: &[[usize; 2]]) -> Vec<Keypoint> {
    let network = fitted(net, card).unwrap();
    let mut rgb = vec![0; 3 * 12 * 16];
    for [x, y] in white {
        let pixel = 3 * (12 * y + x);
        rgb[pixel..pixel + 3].fill(1);
    }
    let image = Rgb8View::new(12, 16, &rgb).unwrap();
    let mut workspace = Workspace::default();
    let sight = network.look(image, [0.0, 0.0, 12.0, 16.0], &mut workspace);
    sight.unwrap().unwrap().keypoints().unwrap()
}

#[test]
fn an_input_of_another_name_or_other_sides_is_refused() {
    let named = CARD.replace("[crop]", "name = \"image\"\n[crop]");
    assert_eq!(
        refused(&network("Relu"), &named),
        "the card names the input `image`, but the network has only `picture` [1, 3, 16, 12]"
    );
    for (from, to, expected) in [
        ("width = 12", "width = 24", "[1, 3, 16, 24]"),
        ("[crop]", "layout = \"pixels\"\n[crop]", "[1, 16, 12, 3]"),
    ] {
        assert_eq!(
            refused(&network("Relu"), &CARD.replace(from, to)),
            format!(
                "the input `picture` of the network is [1, 3, 16, 12], but the card states {expected}"
            )
        );
    }
}

#[test]
fn the_card_selects_one_of_several_inputs_or_outputs() {
    let mut net = network("Relu");
    net.inputs.push(("more".to_owned(), sides(&[1])));
    let said = refused(&net, CARD);
    assert!(
        said.contains("`picture` [1, 3, 16, 12], `more` [1]") && said.contains("`input.name`"),
        "{said}"
    );
    let mut net = network("Relu");
    net.outputs.push(("again".to_owned(), sides(&[1, 3, 16, 12])));
    net.node("Relu", &["maps"], "again", vec![]);
    let said = refused(&net, CARD);
    assert!(
        said.contains("`again` [1, 3, 16, 12]") && said.contains("`output.maps`"),
        "{said}"
    );
    let named = CARD.replace("refine", "maps = \"again\"\nrefine");
    assert_eq!(keypoints(&net, &named, &[[5, 9]])[1].at, [5.0, 9.0]);
}

#[test]
fn a_missing_output_is_refused() {
    let named = CARD.replace("refine", "maps = \"heat\"\nrefine");
    assert_eq!(
        refused(&network("Relu"), &named),
        "the card names the output `heat`, but the network has only `maps` [1, 3, 16, 12]"
    );
}

#[test]
fn a_wrong_number_of_maps_or_values_is_refused() {
    let two = CARD.replace(", \"c\"", "");
    assert_eq!(
        refused(&network("Relu"), &two),
        "output `maps`: the output is [1, 3, 16, 12], expected [1, 2, rows, columns]"
    );
    let further = two.replace("refine", "further = 1\nrefine");
    assert_eq!(keypoints(&network("Relu"), &further, &[[5, 9]]).len(), 2);
    let list = "codec = \"keypoints\"\nfields = [\"x\", \"y\"]";
    let list = CARD.replace("codec = \"heat-map\"\nrefine = \"none\"", list);
    assert_eq!(
        refused(&network("Relu"), &list),
        "output `maps`: the output is [1, 3, 16, 12], expected 3 keypoints of 2 numbers"
    );
}

#[test]
fn values_that_are_not_finite_are_refused_at_run_time() {
    assert_eq!(
        refused(&network("Log"), CARD),
        "output `maps`: value 0 of the output is -inf, which is not finite"
    );
    // The first run on an empty picture succeeds.
    let shifted = CARD.replace("[crop]", "mean = [-1.0, -1.0, -1.0]\n[crop]");
    let mut net = network("Relu");
    net.nodes.clear();
    net.floats("half", &[1], vec![1.5]);
    net.node("Sub", &["half", "picture"], "rest", vec![]);
    net.node("Log", &["rest"], "maps", vec![]);
    let network = fitted(&net, &shifted).unwrap();
    let image = [1; 3 * 12 * 16];
    let image = Rgb8View::new(12, 16, &image).unwrap();
    let mut workspace = Workspace::default();
    let refused = network.look(image, [0.0, 0.0, 12.0, 16.0], &mut workspace).unwrap_err();
    assert!(
        matches!(
            refused,
            LookError::Output {
                error: OutputError::NotANumber { .. },
                ..
            }
        ),
        "{refused}"
    );
    assert!(refused.to_string().contains("NaN"), "{refused}");
}

#[test]
fn integer_outputs_are_refused() {
    let mut net = network("Relu");
    net.nodes.clear();
    let keep = vec![("axis", Attribute::Int(1)), ("keepdims", Attribute::Int(1))];
    net.node("ArgMax", &["picture"], "maps", keep);
    assert_eq!(refused(&net, CARD), "the output `maps` is not of type f32");
}

/// Makes a network that returns distributions over columns and rows, computed from the brightest pixel of each column and row. Also returns
/// the network's card.
pub(super) fn distributions() -> (Network, String) {
    let mut net = network("Relu");
    net.nodes.clear();
    net.outputs = vec![
        ("across".to_owned(), sides(&[1, 3, 12])),
        ("down".to_owned(), sides(&[1, 3, 16])),
    ];
    for (axis, name) in [(2, "across"), (3, "down")] {
        let along = vec![
            ("axes", Attribute::Ints(vec![axis])),
            ("keepdims", Attribute::Int(0)),
        ];
        net.node("ReduceMax", &["picture"], name, along);
    }
    let simcc = "codec = \"simcc\"\nx = \"across\"\ny = \"down\"\nbins_per_pixel = 1";
    let simcc = CARD.replace("codec = \"heat-map\"\nrefine = \"none\"", simcc);
    (net, simcc)
}

#[test]
fn columns_and_rows_are_read_from_two_outputs() {
    let (net, simcc) = distributions();
    let found = keypoints(&net, &simcc, &[[5, 9]]);
    assert_eq!((found[2].at, found[2].score), ([5.0, 9.0], 1.0));
    let exchanged = simcc.replace("\"across\"", "\"x\"").replace("\"down\"", "\"across\"");
    let exchanged = exchanged.replace("\"x\"", "\"down\"");
    assert_eq!(
        refused(&net, &exchanged),
        "output `down`, `across`: the output is [1, 3, 16], expected [1, 3, 12]"
    );
    let missing = simcc.replace("\"down\"", "\"up\"");
    assert!(refused(&net, &missing).contains("the output `up`"));
}

#[test]
fn a_cell_is_anchored_at_its_first_pixel_or_at_its_middle() {
    let mut net = network("Relu");
    net.nodes.clear();
    net.outputs[0].1 = sides(&[1, 3, 4, 3]);
    let of_four = || Attribute::Ints(vec![4, 4]);
    let pool = vec![("kernel_shape", of_four()), ("strides", of_four())];
    net.node("MaxPool", &["picture"], "maps", pool);
    let plain = CARD.replace("[\"a\", \"b\", \"c\"]", "[\"right hip\", \"b\", \"c\"]");
    let centred = plain.replace("refine", "centred = true\nrefine");
    for (card, expected) in [(&plain, [4.0, 8.0]), (&centred, [5.5, 9.5])] {
        let network = fitted(&net, card).unwrap();
        let mut rgb = vec![0; 3 * 12 * 16];
        rgb[3 * (12 * 9 + 5)..][..3].fill(1);
        let image = Rgb8View::new(12, 16, &rgb).unwrap();
        let mut workspace = Workspace::default();
        let sight = network.look(image, [0.0, 0.0, 12.0, 16.0], &mut workspace);
        let sight = sight.unwrap().unwrap();
        assert_eq!(sight.keypoints().unwrap()[0].at, expected);
        // The peaks of the maps used by fusion are at the keypoints.
        let mut maps = JointMaps::default();
        maps.read(&sight, &MapSettings::default()).unwrap();
        assert_eq!(maps.maxima(2, 1)[0].0, expected);
        let beside = expected.map(|expected| expected + 1.0);
        assert!(maps.at(2, expected) > maps.at(2, beside));
    }
}

#[test]
fn a_list_of_keypoints_is_read_with_its_unit() {
    let mut net = network("Relu");
    net.nodes.clear();
    net.outputs[0].1 = sides(&[1, 1, 3, 3]);
    // The network returns the mean of the picture, which is black, and positions.
    net.floats(
        "places",
        &[9],
        vec![0.5, 0.25, 0.9, 0.0, 1.0, 0.1, 0.75, 0.5, 0.2],
    );
    net.node("GlobalMaxPool", &["picture"], "pooled", vec![]);
    net.ints("shape", vec![1, 3]);
    net.node("Reshape", &["pooled", "shape"], "three", vec![]);
    let last = vec![("axis", Attribute::Int(1))];
    net.node("Concat", &["three", "three", "three"], "nine", last);
    net.node("Add", &["nine", "places"], "added", vec![]);
    net.ints("listed", vec![1, 1, 3, 3]);
    net.node("Reshape", &["added", "listed"], "maps", vec![]);
    let list = "codec = \"keypoints\"\nfields = [\"y\", \"x\", \"score\"]\nunit = \"share\"";
    let list = CARD.replace("codec = \"heat-map\"\nrefine = \"none\"", list);
    let found = keypoints(&net, &list, &[]);
    assert_eq!([found[0].at, found[1].at], [[3.0, 8.0], [12.0, 0.0]]);
    assert!((found[2].score - 0.2).abs() < 1e-6);
}

#[test]
fn a_network_with_byte_input_fits_a_card_with_integer_input() {
    let mut net = network("Relu");
    net.nodes.clear();
    net.node(
        "Cast",
        &["picture"],
        "maps",
        vec![("to", Attribute::Int(1))],
    );
    // Changes the type of the input to bytes instead of single precision.
    let mut file = net.file();
    let input = file.windows(7).rposition(|window| window == b"picture").unwrap();
    let kind = file[input..].windows(3).position(|window| window == [8, 1, 18]);
    file[input + kind.unwrap() + 1] = 2;
    let fitted = |numbers: &str| {
        let card = CARD.replace(
            "height = 16",
            &format!("height = 16\nnumbers = \"{numbers}\""),
        );
        PoseNetwork::new(
            Session::parse(file.clone()).unwrap(),
            Card::parse(&card).unwrap(),
        )
    };
    for numbers in ["i32", "u8"] {
        let network = fitted(numbers).unwrap();
        assert_eq!(network.card().input.numbers, Numbers::U8);
    }
    // Input values that were prepared for single precision would not fit this type.
    fitted("f32").unwrap_err();
}
