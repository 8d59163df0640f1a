//! Replaces a process of a deployment: sends the messages that the process sent when they were recorded.

mod clock;
mod job;
mod service;

pub use clock::Pace;
pub use job::{Job, Output};
pub use service::run;
