//! Frames in, single-view candidates and their evidence out.
#![forbid(unsafe_code)]

mod config;

pub use config::{All, Config, Window};
