//! The network that finds people in a whole picture: its training data and its training.
//!
//! * [`Picture`]: a picture with a box around each person.
//! * [`varied`], [`plain`]: the inputs made from pictures, and the outputs that the network should give.
//! * [`FinderTask`]: the training.
//! * [`card()`]: how to use the trained network. `keypoints::DetectorCard` reads the card and decodes the outputs of the network.
//! * [`Score`]: measures of the network's quality.
//!
//! Pixels have their centres at integers.

mod card;
mod cost;
mod network;
mod picture;
mod score;
mod settings;
mod task;
mod vary;

pub use card::card;
pub use cost::{Cost, Truth};
pub use network::{BOXES, CHANNELS, PICTURE, STRIDE, Shape, begun, initial};
pub use picture::{Around, Picture, SIDE};
pub use score::{Score, Tally};
pub use settings::{Settings, Vary};
pub use task::FinderTask;
pub use vary::{FinderSample, plain, varied};
