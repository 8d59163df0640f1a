//! The answers of the pairs in, joints in the world out.
#![forbid(unsafe_code)]

mod config;

pub use config::Config;
