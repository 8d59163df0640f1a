//! The card of a trained network: what Parallax has to know to use it.

use super::network::{BOXES, PICTURE, STRIDE, Shape};
use super::score::Score;
use crate::networks::pose::{DEVIATION, FILL, MEAN};

/// Boxes with a lower score are dropped.
const LEAST_SCORE: f64 = 0.2;
/// The worse of two boxes that share more than this of their union is dropped: people who stand in front of each other share more
/// than half.
const MOST_OVERLAP: f64 = 0.65;

/// Facts that a card tells beside how the network is used.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct About {
    /// Pictures learned from, and kept apart.
    pub pictures: [usize; 2],
    /// Samples that the network was shown.
    pub samples: usize,
    /// Set where it went on from a network that was trained before.
    pub goes_on: bool,
    /// How good it is on those that were kept apart.
    pub score: Score,
}

/// The text of the card, TOML.
pub fn card(shape: &Shape, about: &About) -> String {
    let [learnt, kept] = about.pictures;
    let Score {
        people,
        recall,
        false_boxes,
        ..
    } = about.score;
    let before = if about.goes_on {
        " after those of another network that it began with"
    } else {
        ""
    };
    let (recall, fill, side) = (100.0 * recall, FILL as u8, shape.side);
    format!(
        "\
# A network of `parallax-lab train finder`: {learnt} pictures, {samples} samples{before}. In {kept} pictures that were kept apart it finds
# {recall:.1} % of {people} people, and {false_boxes:.2} boxes a picture that are of nobody.
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
