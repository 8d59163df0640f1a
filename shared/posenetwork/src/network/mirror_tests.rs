//! Tests of networks that also process mirror images: for a symmetric picture, the result with mirror images is the same as without.

use inference::onnx::{Attribute, Network};

use super::tests::{CARD, distributions, fitted, network, sides};
use super::*;

/// A picture of 12 x 16 pixels in which no two pixels are alike.
fn picture() -> Vec<u8> {
    (0..3 * 12 * 16).map(|i| (i * 37 % 251) as u8).collect()
}

/// The first output without and with mirror images.
fn both(net: &Network, card: &str) -> [Vec<Vec<f32>>; 2] {
    let rgb = picture();
    let image = Rgb8View::new(12, 16, &rgb).unwrap();
    [false, true].map(|is_mirrored| {
        let mut network = fitted(net, card).unwrap();
        if is_mirrored {
            network = network.mirrored().unwrap();
        }
        let mut workspace = Workspace::default();
        let outline = [0.0, 0.0, 12.0, 16.0];
        let sight = network.look(image, outline, &mut workspace).unwrap();
        let outputs = sight.unwrap().outputs;
        outputs.iter().map(|output| output.values.clone()).collect()
    })
}

fn pooled() -> Network {
    let mut net = network("Relu");
    net.nodes.clear();
    net.outputs[0].1 = sides(&[1, 3, 4, 3]);
    let of_four = || Attribute::Ints(vec![4, 4]);
    let pool = vec![("kernel_shape", of_four()), ("strides", of_four())];
    net.node("MaxPool", &["picture"], "maps", pool);
    net
}

#[test]
fn a_symmetric_network_gives_the_same_result_for_the_mirror_image() {
    let [plain, mirrored] = both(&network("Relu"), CARD);
    assert_eq!(plain, mirrored);
    let centred = CARD.replace("refine", "centred = true\nrefine");
    let [plain, mirrored] = both(&pooled(), &centred);
    assert_eq!(plain, mirrored);
}

#[test]
fn bins_of_columns_are_mirrored_and_bins_of_rows_are_not() {
    let (net, simcc) = distributions();
    let [plain, mirrored] = both(&net, &simcc);
    assert_eq!(plain, mirrored);
}

#[test]
fn left_and_right_maps_are_averaged_with_the_mirror_image() {
    let card = CARD.replace(
        "[\"a\", \"b\", \"c\"]",
        "[\"left hip\", \"right hip\", \"c\"]",
    );
    let [plain, mirrored] = both(&network("Relu"), &card);
    let n = 12 * 16;
    let (left, right) = (&plain[0][..n], &plain[0][n..2 * n]);
    let mean: Vec<f32> = left.iter().zip(right).map(|(a, b)| f32::midpoint(*a, *b)).collect();
    assert_eq!(mirrored[0][..n], mean[..]);
    assert_eq!(mirrored[0][n..2 * n], mean[..]);
    assert_eq!(mirrored[0][2 * n..], plain[0][2 * n..]);
}

#[test]
fn directions_to_the_right_become_directions_to_the_left_in_the_mirror_image() {
    let mut net = network("Relu");
    net.outputs.push(("front".to_owned(), sides(&[1, 2])));
    net.floats("constant", &[1, 2], vec![0.5, 1.5]);
    net.node("Identity", &["constant"], "front", vec![]);
    net.outputs.push(("error".to_owned(), sides(&[1, 3])));
    net.floats("errors", &[1, 3], vec![0.1, 0.3, 0.5]);
    net.node("Identity", &["errors"], "error", vec![]);
    let card = CARD.replace("refine", "maps = \"maps\"\nrefine").replace(
        "[\"a\", \"b\", \"c\"]",
        "[\"left hip\", \"right hip\", \"c\"]",
    );
    let card = format!("{card}[also]\nfront = \"front\"\nerror = \"error\"\n");
    let [_, mirrored] = both(&net, &card);
    assert_eq!(mirrored[1], [0.0, 1.5]);
    assert_eq!(mirrored[2], [0.2, 0.2, 0.5]);
}

#[test]
fn cells_anchored_at_their_first_pixel_are_shifted_by_one_in_the_mirror_image() {
    let [plain, mirrored] = both(&pooled(), CARD);
    // The first column has no counterpart and stays as it is. The second column is averaged with the third of the mirror image, which is
    // the first of the picture.
    for row in 0..12 {
        let [first, second, third] = [0, 1, 2].map(|i| plain[0][3 * row + i]);
        let expected = [
            first,
            f32::midpoint(second, first),
            f32::midpoint(third, second),
        ];
        assert_eq!(mirrored[0][3 * row..3 * row + 3], expected, "{row}");
    }
}

#[test]
fn a_network_without_left_and_right_pairs_is_refused() {
    let lonely = CARD.replace("\"a\"", "\"left hip\"");
    let refused = fitted(&network("Relu"), &lonely).unwrap().mirrored();
    assert_eq!(
        refused.unwrap_err().to_string(),
        "the network cannot process mirror images: there is a keypoint `left hip`, but no `right hip`"
    );
}
