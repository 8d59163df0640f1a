//! Writes what a deployment leaves behind.
#![forbid(unsafe_code)]

mod config;

pub use config::Config;
