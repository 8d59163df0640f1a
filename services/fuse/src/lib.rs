//! Candidates of all views in; out, by the method of networks who is who, by the paper's the answers of camera pairs on the evidence.
#![forbid(unsafe_code)]

mod input;
mod job;
mod service;
mod settings;
mod who;
mod worker;

pub use job::Job;
pub use service::run;
pub use settings::{follow, settings, tau_px, views};
pub use who::{WhoJob, run_who};
