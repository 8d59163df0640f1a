//! Tests of networks with rotated pictures: a network that does not depend on the orientation of the picture gives the same result.

use inference::onnx::Network;

use super::tests::{CARD, distributions, fitted, network, sides};
use super::*;

const TURNS: [Turn; 4] = [Turn::Up, Turn::Right, Turn::Down, Turn::Left];

/// A picture of 16 x 16 pixels in which no two pixels are alike.
fn picture() -> Vec<u8> {
    (0..3 * 16 * 16).map(|i| (i * 37 % 251) as u8).collect()
}

/// The keypoints found in a square box of the picture.
fn found(net: &Network, card: &str, turn: Turn) -> Vec<Keypoint> {
    let rgb = picture();
    let image = Rgb8View::new(16, 16, &rgb).unwrap();
    let network = fitted(net, card).unwrap();
    let mut workspace = Workspace::default();
    let boxed = ([0.0, 0.0, 16.0, 16.0], turn);
    let sight = network.look_turned(image, boxed, &mut workspace).unwrap();
    sight.unwrap().keypoints().unwrap()
}

#[test]
fn a_rotation_invariant_network_gives_the_same_in_every_rotation() {
    // The window has the proportions 12 x 16 or 16 x 12, and is enlarged to contain the box.
    let upright = found(&network("Relu"), CARD, Turn::Up);
    let place = |keypoint: &Keypoint| keypoint.at.map(|at| at.round() as i64);
    for turn in TURNS {
        for (a, b) in found(&network("Relu"), CARD, turn).iter().zip(&upright) {
            assert_eq!(place(a), place(b), "{turn:?}");
        }
    }
}

#[test]
fn distributions_over_columns_and_rows_are_rotated_too() {
    let (net, simcc) = distributions();
    let upright = found(&net, &simcc, Turn::Up);
    let place = |keypoint: &Keypoint| keypoint.at.map(|at| at.round() as i64);
    for turn in TURNS {
        for (a, b) in found(&net, &simcc, turn).iter().zip(&upright) {
            assert_eq!(place(a), place(b), "{turn:?}");
        }
    }
}

#[test]
fn the_direction_rotates_with_the_picture() {
    let mut net = network("Relu");
    net.outputs.push(("front".to_owned(), sides(&[1, 2])));
    net.floats("constant", &[1, 2], vec![0.5, 1.5]);
    net.node("Identity", &["constant"], "front", vec![]);
    let card = CARD.replace("refine", "maps = \"maps\"\nrefine");
    let card = format!("{card}[also]\nfront = \"front\"\n");
    let rgb = picture();
    let image = Rgb8View::new(16, 16, &rgb).unwrap();
    let network = fitted(&net, &card).unwrap();
    let fronts = TURNS.map(|turn| {
        let mut workspace = Workspace::default();
        let boxed = ([0.0, 0.0, 16.0, 16.0], turn);
        let sight = network.look_turned(image, boxed, &mut workspace).unwrap();
        sight.unwrap().front().unwrap()
    });
    assert_eq!(fronts, [[0.5, 1.5], [0.0, 1.5], [-0.5, 1.5], [0.0, 1.5]]);
}
