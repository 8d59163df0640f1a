//! Training of the network that predicts how far off every part of a single view is (the paper's section 4.3).
#![forbid(unsafe_code)]

pub mod network;
pub mod onnx;
pub mod parameters;

#[cfg(feature = "burn")]
pub mod learn;
