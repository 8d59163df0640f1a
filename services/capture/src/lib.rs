//! Reads the footage of a camera, and sends its frames.
#![forbid(unsafe_code)]

mod config;

pub use config::{Camera, Config, Mode, Pace};
