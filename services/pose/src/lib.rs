//! Receives frames, sends single-view candidates and their evidence.
#![forbid(unsafe_code)]

mod config;
mod job;
mod service;
mod view;

pub use config::{All, Config, Search, Window};
pub use job::Job;
pub use service::run;
