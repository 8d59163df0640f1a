//! Frames and candidates in, the expected error of every part out.
#![forbid(unsafe_code)]

mod config;

pub use config::Config;
