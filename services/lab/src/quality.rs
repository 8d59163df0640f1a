//! The network that predicts the errors of single views: its samples, and its training.

pub mod network;
pub mod samples;

mod observer;
mod replace;
mod work;

pub use crate::scenes::Scenes;
