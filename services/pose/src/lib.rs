//! Receives frames, sends single-view candidates and their evidence.
#![forbid(unsafe_code)]

mod job;
mod service;
mod settings;
mod view;

pub use job::Job;
pub use service::run;
pub use settings::{precision, settings};
