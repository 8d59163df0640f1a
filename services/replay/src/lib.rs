//! Stands in for a process of a deployment: sends what the process once sent.
#![forbid(unsafe_code)]

mod clock;
mod service;

pub use clock::Pace;
pub use service::{Job, Line, run};
