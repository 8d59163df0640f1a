//! Receives the poses of pairs, sends joints in the world.
#![forbid(unsafe_code)]

mod service;
mod settings;

pub use service::{Job, run};
pub use settings::combine;
