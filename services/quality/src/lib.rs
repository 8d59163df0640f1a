//! Frames and candidates in, the expected error of every part out.
#![forbid(unsafe_code)]

mod config;
mod service;

pub use config::Config;
pub use service::{Job, Looking, Source, run};
pub use stage::HELD_REALTIME;
pub use viewquality::Device;
