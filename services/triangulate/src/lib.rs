//! Receives the poses of pairs, sends joints in the world.
#![forbid(unsafe_code)]

mod config;
mod service;

pub use config::{Combine, Config};
pub use service::{Job, run};
