//! Fuses the candidates of all views. If networks find the people, sends the identities of people. With the paper's method, sends the poses
//! of camera pairs.

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
