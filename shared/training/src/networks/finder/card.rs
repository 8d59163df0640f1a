//! The card of a trained network: the information that Parallax needs to use the network.

use super::network::{BOXES, PICTURE, STRIDE, Shape};
use super::score::Score;
use crate::networks::course::About;
use crate::networks::pose::{DEVIATION, FILL, MEAN};

/// Minimum score of a box that is kept.
const LEAST_SCORE: f64 = 0.2;
/// Overlap (intersection over union) above which the box with the lower score is dropped. Boxes of people who stand in front of each other
/// can overlap by more than half.
const MOST_OVERLAP: f64 = 0.65;

/// The text of the card, in TOML.
pub fn card(shape: &Shape, about: &About<Score>) -> String {
    let [learnt, kept] = about.examples;
    let Score {
        people,
        recall,
        false_boxes,
        ..
    } = about.score;
    let before = if about.goes_on {
        " after those of the network from which it started"
    } else {
        ""
    };
    let (recall, fill, side) = (100.0 * recall, FILL as u8, shape.side);
    format!(
        "\
# A network of `parallax-lab train finder`: {learnt} pictures, {samples} samples{before}. In {kept} held-out pictures, it finds
# {recall:.1} % of {people} people, and {false_boxes:.2} boxes per picture without a person.
format = \"parallax-detector\"
version = 1
name = \"Parallax, boxes of people, {side}x{side}\"
fill = {fill}
least_score = {LEAST_SCORE}
most_overlap = {MOST_OVERLAP}

[input]
name = \"{PICTURE}\"
width = {side}
height = {side}
mean = [{MEAN:?}, {MEAN:?}, {MEAN:?}]
std = [{DEVIATION:?}, {DEVIATION:?}, {DEVIATION:?}]

[output]
codec = \"centres\"
boxes = \"{BOXES}\"
stride = {STRIDE}
",
        samples = about.samples
    )
}
