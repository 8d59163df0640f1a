//! The network that ships, run by the library that the service uses.

use skeleton::N_PARTS;
use viewquality::{Network, TileShape, Unit, n_evidence};

const FILE: &[u8] = include_bytes!("../../../configs/models/person.quality.onnx");

/// What ONNX Runtime 1.31.1 says of the inputs below.
const SAID: [f32; N_PARTS] = [
    0.10085, -2.33717, -2.05875, -3.95597, -5.03065, -6.81295, -7.24334, -2.10109, -2.68198,
    -2.13794, -3.04860, -4.13073, -4.04418, -3.80435, -2.06088, -3.75435, -4.72974, -3.96638,
    -4.92643, -1.57025, -1.46136, -0.68546, 0.34898, 0.41216, -0.76105, -0.81714,
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
