//! Computes joints in the world: receives the people of a frame with the evidence, or the poses of pairs, and sends skeletons.

mod in_space;
mod service;
mod settings;

pub use in_space::{SpaceJob, run_in_space};
pub use service::{Job, run};
pub use settings::combine;
