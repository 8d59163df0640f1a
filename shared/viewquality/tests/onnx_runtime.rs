//! ONNX Runtime instead of `rten`: the same errors and the same numbers.
//!
//! The user provides the library, so this test runs where there is one (its build without CUDA):
//! `ONNX_RUNTIME=/usr/lib/libonnxruntime.so cargo test -p viewquality --features ort-here`
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::{Path, PathBuf};

use inference::LoadError;
use testkit::networks::of_colours;
use viewquality::{Network, OnnxRuntime, TileShape, n_evidence};

const SHIPPED: &[u8] = include_bytes!("../../../configs/models/person.quality.onnx");
const N_PARTS: usize = 26;

/// The path is not a setting of Parallax, since it differs between machines.
fn library() -> PathBuf {
    std::env::var_os("ONNX_RUNTIME").unwrap().into()
}

fn runtime() -> OnnxRuntime {
    OnnxRuntime::load(&library()).unwrap()
}

#[test]
fn a_missing_library_is_named() {
    let error = OnnxRuntime::load(Path::new("/nowhere/libonnxruntime.so")).unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(matches!(error, LoadError::Library(_)), "{error}");
    assert!(cause.contains("/nowhere/libonnxruntime.so"), "{cause}");
}

#[test]
fn the_shipped_network_gives_the_same_output() {
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
    let [got, expected] = [&network, &by_rten].map(|it| it.run(&tile, &evidence).unwrap());
    for (got, expected) in got.iter().zip(&expected) {
        assert!((got - expected).abs() < 1e-4, "{got}, {expected}");
    }
}

#[test]
fn invalid_networks_are_rejected_with_the_same_errors() {
    let runtime = runtime();
    let got = |net: &onnx::Network, n_parts| {
        let by_rten = Network::parse(net.file(), n_parts).unwrap_err().to_string();
        let got = Network::parse_with(&runtime, &net.file(), n_parts).unwrap_err();
        assert_eq!(got.to_string(), by_rten);
        by_rten
    };
    let expected = "`sigma` of the network is f32 [1, 2], expected f32 [1, 26]";
    assert_eq!(got(&of_colours(), 26), expected);
    let mut net = of_colours();
    net.metadata
        .push(("parallax.tile".to_owned(), "160x64".to_owned()));
    got(&net, 2);
    let mut net = of_colours();
    net.inputs[0].0 = "image".to_owned();
    net.nodes[0].inputs[0] = "image".to_owned();
    got(&net, 2);
}

#[test]
fn unknown_operations_and_truncated_files_are_rejected() {
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
fn an_unsupported_device_is_rejected() {
    let runtime = OnnxRuntime::load(&library()).unwrap().on_cuda();
    let error = Network::parse_with(&runtime, SHIPPED, N_PARTS).unwrap_err();
    let cause = std::error::Error::source(&error).unwrap().to_string();
    assert!(cause.contains("CUDA"), "{cause}");
}
