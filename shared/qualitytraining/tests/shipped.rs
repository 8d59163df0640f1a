//! The network that ships, run by the library that the service uses.

use skeleton::N_PARTS;
use viewquality::{Network, TileShape, Unit, n_evidence};

const FILE: &[u8] = include_bytes!("../../../configs/models/person.quality.onnx");

/// What ONNX Runtime 1.31.1 says of the inputs below.
const SAID: [f32; N_PARTS] = [
    0.60563, -0.87546, 0.01654, -6.20769, -9.04086, -11.30744, -11.61246, -1.42816, -1.79567,
    -2.36791, -3.67435, -2.57038, -1.66239, 0.25410, -0.51372, -4.11765, -7.04362, -9.29187,
    -8.81091, -2.35204, -2.48034, -1.58878, -2.61565, -3.88359, -3.83519, -1.86625,
];

#[test]
fn the_shipped_network_says_of_itself_what_it_is_and_says_what_another_program_says() {
    let network = Network::parse(FILE.to_vec(), N_PARTS).unwrap();
    assert!(network.takes_tile() && network.takes_evidence());
    assert_eq!(network.tile_shape(), TileShape::SMALL);
    assert_eq!(network.card().unit, Unit::LogRelative);
    assert_eq!(network.card().identity, "person.quality");
    assert!(network.card().tau.iter().all(|it| (0.01..0.2).contains(it)));
    let tile: Vec<f32> = (0..TileShape::SMALL.n_values())
        .map(|it| ((it % 11) as f32 - 5.0) * 0.1)
        .collect();
    let evidence: Vec<f32> = (0..n_evidence(N_PARTS))
        .map(|it| (it % 7) as f32 * 0.1)
        .collect();
    let said = network.run(&tile, &evidence).unwrap();
    for (part, (said, expected)) in said.iter().zip(SAID).enumerate() {
        assert!(
            (said - expected).abs() < 1e-4,
            "part {part}: {said}, {expected}"
        );
    }
}
