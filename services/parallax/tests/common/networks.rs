//! Networks that are small enough to be defined in tests.

use inference::onnx::{Attribute, Network, Side};

/// Card for [`detector_of`].
pub(crate) const DETECTOR: &str = r#"
format = "parallax-detector"
version = 1
name = "The same box always"
input = { width = 64, height = 64, scale = 0.00392156862745098 }
output = { codec = "list", boxes = "dets" }
"#;

/// Returns the dimensions of a network's input or output.
pub(crate) fn sides(n: [usize; 4]) -> Vec<Side> {
    n.map(Side::Fixed).to_vec()
}

/// Returns a detector that finds the same box in every picture: left, top, right and bottom, in pixels of its input of 64 by 64. The score
/// is `score` plus a ten-thousandth of the mean colour.
pub(crate) fn detector_of([left, top, right, bottom]: [f32; 4], score: f32) -> Network {
    let mut net = Network::default();
    net.inputs.push(("picture".to_owned(), sides([1, 3, 64, 64])));
    net.outputs.push(("dets".to_owned(), [1, 1, 5].map(Side::Fixed).to_vec()));
    net.floats("box", &[1, 1, 5], vec![left, top, right, bottom, score]);
    net.floats("little", &[1], vec![1e-4]);
    net.ints("flat", vec![1, 1, 1]);
    net.floats("mixture", &[1, 3, 1, 1], vec![1.0 / 3.0; 3]);
    let whole = || Attribute::Ints(vec![64, 64]);
    let attributes = vec![("kernel_shape", whole()), ("strides", whole())];
    net.node("AveragePool", &["picture"], "colours", attributes);
    let one = vec![("kernel_shape", Attribute::Ints(vec![1, 1]))];
    net.node("Conv", &["colours", "mixture"], "mean", one);
    net.node("Mul", &["mean", "little"], "less", vec![]);
    net.node("Reshape", &["less", "flat"], "offset", vec![]);
    net.node("Add", &["box", "offset"], "dets", vec![]);
    net
}
