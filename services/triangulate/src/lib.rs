//! The answers of the pairs in, joints in the world out.
#![forbid(unsafe_code)]

mod config;
mod service;

pub use config::Config;
pub use service::{Job, run};
