//! Training of the network that finds joints in the picture of one person: the method.
//!
//! * [`Person`]: a picture of a person whose joints are known; [`Marks`] makes one of what was marked and what a
//!   teacher found.
//! * [`varied`], [`plain`]: what the network is shown of a person, and what it should find.
//! * `Trainer`: learns from people, step by step (with the feature `burn`; `libtorch` for real trainings).
//! * `begun`: the parameters of a network that was trained before, to go on from.
//! * [`write()`]: the trained network as an ONNX file.
//! * [`Score`]: how good it is on people.
//!
//! Labels are **as seen**: whoever is seen from behind has the joints of left and right exchanged, so that the label follows
//! the picture. In which direction the person faces is an output of its own.
//!
//! Pixels have their centres at integers. Nothing here reads or writes files.
#![forbid(unsafe_code)]

mod card;
mod marks;
mod network;
mod onnx;
mod parameters;
mod person;
mod score;
mod settings;
mod vary;

#[cfg(feature = "burn")]
mod begun;
#[cfg(feature = "burn")]
mod learn;
#[cfg(feature = "burn")]
mod trainer;

#[cfg(feature = "burn")]
pub use begun::{BeginError, begun};
pub use card::{About, card};
#[cfg(feature = "burn")]
pub use learn::{Batch, Cost, Found, Learner, Memory, Step};
pub use marks::{Marks, exchange_sides};
pub use network::{N_JOINTS, STRIDE, Shape};
pub use onnx::{ERROR, FRONT, MAPS, PICTURE, write};
pub use parameters::{Parameter, Role, initial};
pub use person::{Person, SIDE, Source, Target, WINDOW};
pub use score::{Judged, Score};
pub use settings::{Backend, Precision, Settings, SettingsError};
#[cfg(feature = "burn")]
pub use trainer::{Pass, TrainError, Trainer};
pub use vary::{DEVIATION, FILL, MARGIN, MEAN, NetworkSample, plain, varied};

/// The joint that is the mirror image of another.
pub const MIRROR: [usize; N_JOINTS] = [5, 4, 3, 2, 1, 0, 11, 10, 9, 8, 7, 6, 12, 13];

/// Where a map is highest, cells: between cells by a quarter towards the higher neighbour.
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
