//! Tests that networks return their known outputs, and that invalid networks are rejected.

use inference::onnx::Side;
use proptest::prelude::*;
use testkit::networks::of_colours;

use super::*;
use crate::Unit;

const N_PARTS: usize = 2;
const SHAPE: TileShape = TileShape {
    height: 4,
    width: 3,
};

/// A network that returns the first two values of the evidence as `sigma`.
fn of_evidence() -> inference::onnx::Network {
    let k = n_evidence(N_PARTS);
    let mut net = inference::onnx::Network::default();
    net.inputs.push(("evidence".to_owned(), vec![Side::Fixed(1), Side::Fixed(k)]));
    net.outputs.push(("sigma".to_owned(), vec![Side::Fixed(1), Side::Fixed(2)]));
    let mut weights = vec![0.0; 2 * k];
    (weights[0], weights[3]) = (1.0, 1.0);
    net.floats("w", &[k, 2], weights);
    net.node("MatMul", &["evidence", "w"], "sigma", vec![]);
    net.metadata.push(("parallax.evidence".to_owned(), "1".to_owned()));
    net
}

fn read(net: &inference::onnx::Network) -> Result<Network, NetworkError> {
    Network::parse(net.file(), N_PARTS)
}

fn rejection(net: &inference::onnx::Network) -> String {
    read(net).unwrap_err().to_string()
}

#[test]
fn a_network_gives_the_known_outputs() {
    let network = read(&of_colours()).unwrap();
    assert_eq!(network.tile_shape(), SHAPE);
    assert!(network.takes_tile() && !network.takes_evidence());
    let mut tile = vec![1.0; 12];
    tile.extend([0.5; 12]);
    tile.extend([-1.0; 12]);
    let sigma = network.run(&tile, &[]).unwrap();
    assert_eq!(sigma, [1.0 + 5.0 - 100.0 + 0.5, 2.0 + 10.0 - 200.0 + 0.25]);
}

#[test]
fn a_network_may_take_only_the_evidence() {
    let network = read(&of_evidence()).unwrap();
    assert!(!network.takes_tile() && network.takes_evidence());
    assert_eq!(network.tile_shape(), TileShape::SMALL);
    let mut evidence = vec![7.0; n_evidence(N_PARTS)];
    (evidence[0], evidence[1]) = (3.0, 4.0);
    assert_eq!(network.run(&[], &evidence).unwrap(), [3.0, 4.0]);
}

#[test]
fn a_network_may_take_the_picture_and_the_evidence() {
    let mut net = of_colours();
    let k = n_evidence(N_PARTS);
    net.inputs.push((
        "evidence".to_owned(),
        vec![Side::Named("n"), Side::Named("k")],
    ));
    net.metadata.push(("parallax.evidence".to_owned(), "1".to_owned()));
    net.nodes.last_mut().unwrap().output = "seen".to_owned();
    net.floats("v", &[k, 2], vec![1.0; 2 * k]);
    net.node("MatMul", &["evidence", "v"], "known", vec![]);
    net.node("Add", &["seen", "known"], "sigma", vec![]);
    let sigma = read(&net).unwrap().run(&[0.0; 36], &vec![0.5; k]).unwrap();
    assert_eq!(sigma, [k as f32 / 2.0 + 0.5, k as f32 / 2.0 + 0.25]);
}

#[test]
fn the_card_of_a_file_is_read() {
    let mut net = of_colours();
    let card = Card {
        tile: Some(SHAPE),
        unit: Unit::LogRelative,
        identity: "three colours".to_owned(),
        tau: vec![0.1, 0.2],
        ..Card::default()
    };
    let entries = card.entries().into_iter();
    net.metadata = entries.map(|(name, it)| (name.to_owned(), it)).collect();
    assert_eq!(*read(&net).unwrap().card(), card);
    net.metadata.push(("parallax.tau".to_owned(), "1".to_owned()));
    assert_eq!(
        rejection(&net),
        "`parallax.tau` is `1`, expected 2 finite numbers of at least 0"
    );
}

#[test]
fn a_tile_without_fixed_size_has_the_size_in_the_card() {
    let mut net = of_colours();
    net.inputs[0].1[2..].copy_from_slice(&[Side::Named("h"), Side::Named("w")]);
    assert_eq!(
        rejection(&net),
        "`tile` of the network is [n, 3, h, w], expected [n, 3, H, W] of known height and width, or \
         `parallax.tile`"
    );
    net.metadata.push(("parallax.tile".to_owned(), "8x6".to_owned()));
    let expected = TileShape {
        height: 8,
        width: 6,
    };
    assert_eq!(read(&net).unwrap().tile_shape(), expected);
}

#[test]
fn rejects_wrong_shapes_with_the_shape_found_and_expected() {
    let mut net = of_colours();
    net.metadata.push(("parallax.tile".to_owned(), "160x64".to_owned()));
    assert_eq!(
        rejection(&net),
        "`tile` of the network is [n, 3, 4, 3], expected [n, 3, 160, 64]"
    );
    let mut net = of_colours();
    net.inputs[0].1[1] = Side::Fixed(1);
    assert!(rejection(&net).starts_with("`tile` of the network is [n, 1, 4, 3], expected"));
    let mut net = of_colours();
    net.inputs[0].1.pop();
    assert!(rejection(&net).starts_with("`tile` of the network is [n, 3, 4], expected"));
    let mut net = of_evidence();
    net.inputs[0].1[1] = Side::Fixed(5);
    assert_eq!(
        rejection(&net),
        "`evidence` of the network is [1, 5], expected [n, 40]"
    );
    let said = Network::parse(of_colours().file(), 26).unwrap_err();
    assert_eq!(
        said.to_string(),
        "`sigma` of the network is f32 [1, 2], expected f32 [1, 26]"
    );
}

#[test]
fn rejects_unknown_inputs_and_outputs_by_name() {
    let mut net = of_colours();
    net.inputs[0].0 = "image".to_owned();
    net.nodes[0].inputs[0] = "image".to_owned();
    assert_eq!(
        rejection(&net),
        "the network has the inputs `image`, expected `tile` f32 [n, 3, H, W], `evidence` f32 \
         [n, K], or both"
    );
    let mut net = of_colours();
    net.outputs[0].0 = "error".to_owned();
    net.nodes[2].output = "error".to_owned();
    assert_eq!(
        rejection(&net),
        "the network has the outputs `error`, expected `sigma` f32 [n, parts]"
    );
}

#[test]
fn evidence_requires_a_version_in_the_file() {
    let mut net = of_evidence();
    net.metadata.clear();
    assert_eq!(
        rejection(&net),
        "the network takes `evidence`, but the file does not declare a version of the evidence"
    );
    let mut net = of_colours();
    net.metadata = of_evidence().metadata;
    assert_eq!(
        rejection(&net),
        "the network does not take `evidence`, but the file declares a version of the evidence"
    );
}

#[test]
fn rejects_unknown_operations() {
    let mut net = of_colours();
    net.nodes[1].op = "Guess".to_owned();
    let error = read(&net).unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(matches!(error, NetworkError::Load(_)), "{error}");
    assert!(cause.contains("Guess"), "{cause}");
}

#[test]
fn rejects_truncated_files_and_other_files() {
    let file = of_colours().file();
    for cut in [0, 1, 10, file.len() / 2, file.len() - 40] {
        assert!(
            Network::parse(file[..cut].to_vec(), N_PARTS).is_err(),
            "{cut}"
        );
    }
    for garbage in [&b"sigma,1,2,3"[..], &[0xff; 64], &[0; 64]] {
        let _refused = Network::parse(garbage.to_vec(), N_PARTS).unwrap_err();
    }
}

#[test]
fn the_fingerprint_depends_on_the_bytes_of_the_file() {
    let [first, second] =
        [of_colours(), of_evidence()].map(|network| read(&network).unwrap().fingerprint());
    assert_eq!(first, formats::checksum::fnv1a_32(&of_colours().file()));
    assert_ne!(first, second);
}

#[test]
fn a_tile_that_is_too_short_is_rejected() {
    let network = read(&of_colours()).unwrap();
    let said = network.run(&[0.0; 35], &[]).unwrap_err().to_string();
    assert_eq!(
        said,
        "`tile` of the network is 35 values, expected 36 values"
    );
}

proptest! {
    #[test]
    fn a_changed_file_is_a_network_or_an_error(at in any::<prop::sample::Index>(), to in any::<u8>(), cut in any::<prop::sample::Index>()) {
        let mut file = of_colours().file();
        let at = at.index(file.len());
        file[at] = to;
        let _outcome = Network::parse(file.clone(), N_PARTS);
        file.truncate(cut.index(file.len()));
        let _outcome = Network::parse(file, N_PARTS);
    }
}
