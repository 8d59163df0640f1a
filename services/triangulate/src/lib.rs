//! The answers of the pairs in, joints in the world out.
#![forbid(unsafe_code)]

mod config;
mod service;

pub use config::{Combine, Config};
pub use service::{Job, run};
