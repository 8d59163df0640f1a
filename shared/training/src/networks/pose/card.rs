//! The card of a trained network: the information that Parallax needs to use the network.

use skeleton::PARSE14;

use super::network::{ERROR, EXTRAS, FRONT, MAPS, PICTURE, Shape};
use super::score::Score;
use super::vary::{DEVIATION, MEAN};
use super::window::{FILL, MARGIN};
use crate::networks::course::About;

/// The text of the card, in TOML.
pub fn card(shape: &Shape, about: &About<Score>) -> String {
    let [learnt, kept] = about.examples;
    let Score {
        people: judged,
        mean_of_ends,
        both_ends,
        front,
        area,
        extras,
    } = about.score;
    let [mean_of_ends, both_ends, front, extras] =
        [mean_of_ends, both_ends, front, extras].map(|share| 100.0 * share);
    let Shape { width, height, .. } = shape;
    let before = if about.goes_on {
        ", after those of the network from which it started"
    } else {
        ""
    };
    let names: Vec<String> = names().map(|name| format!("{name:?}")).collect();
    let names = names.join(", ");
    let fill = FILL as u8;
    format!(
        "\
# A network of `parallax-lab train network`: {learnt} people, {samples} samples{before}. On {judged} of {kept} held-out people, it finds
# {mean_of_ends:.1} % of the limbs by the mean of both ends and {both_ends:.1} % by both ends. It distinguishes {front:.1} % of the directions from
# their opposites. Joints with an error of more than half a head are recognised with an area under the curve of {area:.3}.
# {extras:.1} % of the extra keypoints are within a fifth of the trunk.
format = \"parallax-keypoint-network\"
version = 1
name = \"Parallax, LSP-14, nose and feet as seen, {height}x{width}\"

[input]
name = \"{PICTURE}\"
width = {width}
height = {height}
mean = [{MEAN:?}, {MEAN:?}, {MEAN:?}]
std = [{DEVIATION:?}, {DEVIATION:?}, {DEVIATION:?}]

[crop]
margin = {MARGIN:?}
fill = {fill}

[output]
codec = \"heat-map\"
maps = \"{MAPS}\"
centred = true
score = \"log-odds\"

[keypoints]
names = [{names}]
sides = \"seen\"

[also]
front = \"{FRONT}\"
error = \"{ERROR}\"
",
        samples = about.samples
    )
}

/// Names of the keypoints as written in a card.
fn names() -> impl Iterator<Item = &'static str> {
    let of_cards = |name| if name == "head" { "head top" } else { name };
    let joints = PARSE14.joints.iter().map(|joint| joint.name);
    joints.map(of_cards).chain(EXTRAS)
}
