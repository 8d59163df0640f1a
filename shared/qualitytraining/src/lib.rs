//! Training of the network that predicts the error of every part in a single view (the paper's section 4.3).
#![forbid(unsafe_code)]

pub mod sample;
pub mod settings;
pub mod store;
pub mod vary;

pub mod network;
pub mod onnx;
pub mod parameters;
pub mod vgg;

pub mod judge;
pub mod passes;
pub mod score;

#[cfg(feature = "burn")]
pub mod learn;
#[cfg(feature = "burn")]
pub mod trainer;
