//! Evidence and candidates of all views in, the answers of camera pairs out.
#![forbid(unsafe_code)]

mod config;
mod input;
mod job;
mod service;
mod worker;

pub use config::{Compatibility, Config, Energy, Switch, Tau, TauFile, TauName, Views};
pub use job::Job;
pub use service::run;
