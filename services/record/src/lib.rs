//! Every message of a deployment into one file.
#![forbid(unsafe_code)]

mod ear;
mod queue;
mod sent;
mod service;
mod writer;

pub use service::{Job, Topics, run};
pub use writer::file_of_life;
