//! Networks with outputs that can be computed by hand.

use inference::onnx::{Network, Side};

/// Returns a network whose input is a `tile` of 4 x 3 pixels and whose output is
/// `sigma = means of the three colours x [[1, 2], [10, 20], [100, 200]] + [0.5, 0.25]`.
pub fn of_colours() -> Network {
    let mut net = Network::default();
    let tile = [
        Side::Named("n"),
        Side::Fixed(3),
        Side::Fixed(4),
        Side::Fixed(3),
    ];
    net.inputs.push(("tile".to_owned(), tile.to_vec()));
    net.outputs.push(("sigma".to_owned(), vec![Side::Named("n"), Side::Fixed(2)]));
    net.floats("w", &[3, 2], vec![1.0, 2.0, 10.0, 20.0, 100.0, 200.0]);
    net.floats("b", &[2], vec![0.5, 0.25]);
    net.node("GlobalAveragePool", &["tile"], "mean", vec![]);
    net.node("Flatten", &["mean"], "flat", vec![]);
    net.node("Gemm", &["flat", "w", "b"], "sigma", vec![]);
    net
}
