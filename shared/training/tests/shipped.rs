//! Test of the built-in network, run by the library that the service uses.

use skeleton::N_PARTS;
use viewquality::{Network, TileShape, Unit, n_evidence};

const FILE: &[u8] = include_bytes!("../../../configs/models/person.quality.onnx");

/// Outputs of ONNX Runtime 1.31.1 for the inputs below.
const EXPECTED: [f32; N_PARTS] = [
    13.46167, 9.48007, 12.23528, 9.41267, 7.88748, 5.92177, 3.98284, 11.56391, 10.75032, 10.11086,
    9.87819, 10.48147, 11.17634, 11.12406, 12.27843, 9.34488, 7.74567, 6.53352, 5.10829, 11.92683,
    11.47611, 10.88227, 10.75745, 11.52212, 11.74646, 11.87282,
];

#[test]
fn the_included_network_fits_its_card_and_matches_onnx_runtime() {
    let network = Network::parse(FILE.to_vec(), N_PARTS).unwrap();
    assert!(network.takes_tile() && network.takes_evidence());
    assert_eq!(network.tile_shape(), TileShape::SMALL);
    assert_eq!(network.card().unit, Unit::LogRelative);
    assert_eq!(network.card().identity, "person.quality");
    assert!(network.card().tau.iter().all(|tau| (0.01..0.2).contains(tau)));
    let tile: Vec<f32> = (0..TileShape::SMALL.n_values())
        .map(|at| ((at % 11) as f32 - 5.0) * 0.1)
        .collect();
    let evidence: Vec<f32> = (0..n_evidence(N_PARTS)).map(|at| (at % 7) as f32 * 0.1).collect();
    let output = network.run(&tile, &evidence).unwrap();
    for (part, (output, expected)) in output.iter().zip(EXPECTED).enumerate() {
        assert!(
            (output - expected).abs() < 1e-4,
            "part {part}: {output}, {expected}"
        );
    }
}
