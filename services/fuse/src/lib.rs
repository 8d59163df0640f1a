//! Evidence and candidates of all views in, the answers of camera pairs out.
#![forbid(unsafe_code)]

mod input;
mod job;
mod service;
mod settings;
mod worker;

pub use job::Job;
pub use service::run;
pub use settings::{follow, settings, tau_px, views};
