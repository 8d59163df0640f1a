//! Evidence and candidates of all views in, the answers of camera pairs out.
#![forbid(unsafe_code)]

mod config;

pub use config::{Compatibility, Config, Energy};
