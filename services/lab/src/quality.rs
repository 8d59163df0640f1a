//! Samples and training of the network that predicts the errors of single views.

pub mod network;
pub mod samples;

mod observer;
mod replace;
mod work;

pub use crate::scenes::Scenes;
