//! Frames and candidates in, the expected error of every part out.
#![forbid(unsafe_code)]

mod config;
mod frames;
mod service;

pub use config::{Config, Device};
pub use frames::HELD_REALTIME;
pub use service::{Job, Looking, Source, run};
