//! In which direction a person faces, by the picture of one view.
//!
//! A part detector knows left and right of the picture only: whether the person is seen from the front or
//! from behind must come from elsewhere. Here it comes from what surrounds the head: histograms of oriented
//! gradients and colours of three patches, and a network of one hidden layer. Its two outputs are
//! [`multiview::FrontEvidence`]; several views of one person add theirs up.
//!
//! The method is our own; the paper has nothing in its place.
//!
//! * [`Detector`]: the evidence for a pose of a frame.
//! * [`Tile`]: what it looks at; [`Crop`]: how examples are varied in training.
//! * [`Network`]: its numbers, and the file that holds them.
//! * [`train`](train()): learns them from [`Sample`]s; [`Score`]: how often a network is right.
//!
//! Inference adds and multiplies single-precision numbers in one order only: the same picture and pose give the
//! same bits on every machine.

mod detector;
mod features;
mod file;
mod network;
mod score;
mod tile;
mod train;

pub use detector::{Detector, Workspace, head_of};
pub use file::FileError;
pub use network::Network;
pub use score::{Score, score};
pub use tile::{Crop, TILE, Tile};
pub use train::{Pass, Sample, Settings, train};
