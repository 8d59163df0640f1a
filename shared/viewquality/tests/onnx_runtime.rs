//! ONNX Runtime in place of `rten`: the same words and the same numbers.
//!
//! The library is the user's, so this runs where there is one (its build without CUDA):
//! `ONNX_RUNTIME=/usr/lib/libonnxruntime.so cargo test -p viewquality --features ort-here`
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use testkit::networks::of_colours;
use viewquality::{Device, Network, NetworkError, OnnxRuntime, TileShape, n_evidence};

const SHIPPED: &[u8] = include_bytes!("../../../configs/models/person.quality.onnx");
const N_PARTS: usize = 26;

/// Where the library lies is no setting of Parallax, and no two machines agree on it.
fn library() -> PathBuf {
    std::env::var_os("ONNX_RUNTIME").unwrap().into()
}

fn runtime() -> OnnxRuntime {
    OnnxRuntime::load(&library(), Device::Cpu).unwrap()
}

#[test]
fn a_library_that_is_not_there_is_named() {
    let error =
        OnnxRuntime::load(Path::new("/nowhere/libonnxruntime.so"), Device::Cpu).unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(matches!(error, NetworkError::Library(_)), "{error}");
    assert!(cause.contains("/nowhere/libonnxruntime.so"), "{cause}");
}

#[test]
fn the_shipped_network_says_the_same() {
    let by_rten = Network::parse(SHIPPED.to_vec(), N_PARTS).unwrap();
    let network = Network::parse_with(&runtime(), SHIPPED, N_PARTS).unwrap();
    assert_eq!(network.card(), by_rten.card());
    assert_eq!(network.fingerprint(), by_rten.fingerprint());
    let tile: Vec<f32> = (0..TileShape::SMALL.n_values())
        .map(|it| ((it % 13) as f32 - 6.0) * 0.2)
        .collect();
    let evidence: Vec<f32> = (0..n_evidence(N_PARTS))
        .map(|it| (it % 5) as f32 * 0.2)
        .collect();
    let [said, expected] = [&network, &by_rten].map(|it| it.run(&tile, &evidence).unwrap());
    for (said, expected) in said.iter().zip(&expected) {
        assert!((said - expected).abs() < 1e-4, "{said}, {expected}");
    }
}

#[test]
fn what_does_not_fit_is_refused_in_the_same_words() {
    let runtime = runtime();
    let said = |net: &onnx::Network, n_parts| {
        let by_rten = Network::parse(net.file(), n_parts).unwrap_err().to_string();
        let said = Network::parse_with(&runtime, &net.file(), n_parts).unwrap_err();
        assert_eq!(said.to_string(), by_rten);
        by_rten
    };
    let expected = "`sigma` of the network is f32 [1, 2], expected f32 [1, 26]";
    assert_eq!(said(&of_colours(), 26), expected);
    let mut net = of_colours();
    net.metadata
        .push(("parallax.tile".to_owned(), "160x64".to_owned()));
    said(&net, 2);
    let mut net = of_colours();
    net.inputs[0].0 = "image".to_owned();
    net.nodes[0].inputs[0] = "image".to_owned();
    said(&net, 2);
}

#[test]
fn operations_that_nobody_knows_and_files_cut_off_are_refused() {
    let runtime = runtime();
    let mut net = of_colours();
    net.nodes[1].op = "Guess".to_owned();
    let error = Network::parse_with(&runtime, &net.file(), 2).unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(cause.contains("Guess"), "{cause}");
    let file = of_colours().file();
    for cut in [0, 1, 10, file.len() / 2, file.len() - 40] {
        let cut_off = Network::parse_with(&runtime, &file[..cut], 2);
        assert!(cut_off.is_err(), "{cut}");
    }
}

#[test]
fn a_device_that_the_library_cannot_use_is_refused() {
    let runtime = OnnxRuntime::load(&library(), Device::Cuda).unwrap();
    let error = Network::parse_with(&runtime, SHIPPED, N_PARTS).unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(cause.contains("CUDA"), "{cause}");
}
