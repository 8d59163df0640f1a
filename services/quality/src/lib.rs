//! Receives frames and candidates, sends the expected error of every part.
#![forbid(unsafe_code)]

mod config;
mod service;

pub use config::Config;
pub use service::{Job, NetworkSource, Source, run};
pub use stage::HELD_REALTIME;
pub use viewquality::Device;
