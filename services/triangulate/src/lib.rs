//! Receives who is in a frame and its evidence, or the poses of pairs; sends joints in the world.
#![forbid(unsafe_code)]

mod in_space;
mod service;
mod settings;

pub use in_space::{SpaceJob, run_in_space};
pub use service::{Job, run};
pub use settings::combine;
