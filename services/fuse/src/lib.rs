//! Evidence and candidates of all views in, the answers of camera pairs out.
#![forbid(unsafe_code)]

mod config;
mod evidence;
mod seen;
mod service;

pub use config::{Compatibility, Config, Energy, Switch, Tau, TauFile, TauName, Views};
pub use service::{Job, run};
