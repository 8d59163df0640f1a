//! The network that ships, run by the library that the service uses.

use skeleton::N_PARTS;
use viewquality::{Network, TileShape, Unit, n_evidence};

const FILE: &[u8] = include_bytes!("../../../configs/models/person.quality.onnx");

/// What ONNX Runtime 1.31.1 says of the inputs below.
const SAID: [f32; N_PARTS] = [
    -0.08917, -1.72822, 0.13622, -3.59343, -5.52109, -6.88779, -8.07493, -1.16927, -2.24235,
    -2.90131, -3.24145, -2.34854, -2.42768, -1.99061, -0.42175, -3.83233, -5.61418, -6.76082,
    -8.49684, -0.94342, -1.91740, -1.92225, -2.59847, -1.76323, -1.54834, -0.82378,
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
