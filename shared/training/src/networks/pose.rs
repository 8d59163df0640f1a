//! The network that finds joints in the picture of one person: its training data and its training.
//!
//! * [`Person`]: a picture of a person whose joints are known. [`Marks`] makes one from an annotator's marks and a
//!   teacher's results.
//! * [`varied`], [`plain`]: the inputs made from a person, and the outputs that the network should give.
//! * [`PoseTask`]: the training.
//! * [`begun`]: the parameters of a previously trained network, from which a training run starts.
//! * [`file()`]: a trained network as an ONNX file; [`card()`] describes how to use it.
//! * [`Score`]: measures of the network's quality.
//!
//! Labels are **as seen**: for a person seen from behind, left and right joints are swapped, so that a label depends only on the position
//! in the picture. The direction in which the person faces is a separate output.
//!
//! Pixels have their centres at integers.

mod beside;
mod card;
mod cost;
mod marks;
mod network;
mod person;
mod score;
mod settings;
mod task;
mod vary;
mod window;

pub use card::card;
pub use cost::{Cost, Truth};
pub use marks::{Marks, exchange_sides};
pub use network::{
    ERROR, EXTRAS, FRONT, MAPS, N_JOINTS, N_KEYPOINTS, PICTURE, STRIDE, Shape, begun, initial,
};
pub use person::{Person, SIDE, Source, Target, WINDOW};
pub use score::{Judged, Score};
pub use settings::{Settings, Vary};
pub use task::{Found, PoseTask, file};
pub use vary::{DEVIATION, MEAN, NetworkSample, plain, varied};
pub(in crate::networks) use vary::{coarsen, recolour};
pub use window::{FILL, MARGIN};

/// For each keypoint, the keypoint that is its mirror image.
pub const MIRROR: [usize; N_KEYPOINTS] = [
    5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13, 14, 16, 15, 18, 17,
];

/// Position of the maximum of a map, in cells. The position is moved by a quarter of a cell towards the neighbour with the higher value.
///
/// * `map`: row major, `columns` wide.
pub fn peak(map: &[f32], columns: usize) -> [f32; 2] {
    let mut best = 0;
    for (at, value) in map.iter().enumerate() {
        if *value > map[best] {
            best = at;
        }
    }
    let [x, y] = [best % columns, best / columns];
    let rows = map.len() / columns;
    let towards = |before: usize, after: usize| {
        let difference = map[after] - map[before];
        if difference == 0.0 {
            0.0
        } else {
            difference.signum() * 0.25
        }
    };
    let mut found = [x as f32, y as f32];
    if x > 0 && x + 1 < columns {
        found[0] += towards(best - 1, best + 1);
    }
    if y > 0 && y + 1 < rows {
        found[1] += towards(best - columns, best + columns);
    }
    found
}
