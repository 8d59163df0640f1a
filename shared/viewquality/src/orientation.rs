//! Estimates the direction in which a person faces, from the picture of one view.
//!
//! A part detector only distinguishes left and right of the picture. Whether the person is seen from the front or from behind must be
//! determined separately. This module uses the surroundings of the head. The input of a network with one hidden layer consists of
//! histograms of oriented gradients, and of colours, from three patches. The two outputs of the network are [`multiview::FrontEvidence`].
//! The evidence of several views of one person can be added.
//!
//! The method is our own; the paper does not solve this problem.
//!
//! * [`Detector`]: returns the evidence for a pose of a frame.
//! * [`Tile`]: the detector's input; [`Crop`]: random variation of examples in training.
//! * [`Network`]: the parameters of the detector, and their file.
//! * [`train`](train()): trains them on [`Sample`]s; [`Score`]: how often the direction is right.
//!
//! Inference adds and multiplies single-precision numbers in a fixed order. The same picture and pose therefore give the
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
