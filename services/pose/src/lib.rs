//! Frames in, single-view candidates and their evidence out.
#![forbid(unsafe_code)]

mod config;
mod intake;
mod service;

pub use config::{All, Config, Search, Window};
pub use service::{Job, run};
