//! The network that finds people in a whole picture: which pictures it learns from, and how.
//!
//! * [`Picture`]: a picture with a box around everybody.
//! * [`varied`], [`plain`]: what the network is shown of pictures, and what it should find.
//! * [`FinderTask`]: the training.
//! * [`card()`]: how the trained network is used; `keypoints::DetectorCard` reads it, and decodes what the network gives.
//! * [`Score`]: how good it is on pictures.
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

pub use crate::networks::begun::{BeginError, Begun};
pub use card::{About, card};
pub use cost::{Cost, Truth};
pub use network::{BOXES, CHANNELS, PICTURE, STRIDE, Shape, begun, initial};
pub use picture::{Around, Picture, SIDE};
pub use score::{Score, Tally};
pub use settings::{Settings, Vary};
pub use task::{FinderTask, NobodyShown, file};
pub use vary::{FinderSample, plain, varied};
