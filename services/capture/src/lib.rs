//! Reads the footage of a camera, and sends its frames.
#![forbid(unsafe_code)]

mod camera;
mod config;
mod fault;
mod feed;
mod guard;
mod job;
mod service;
mod supply;

pub use config::{Camera, Config, Mode, Pace};
pub use fault::{Fault, FaultError, FaultKind, Faults};
pub use feed::{Feed, FeedError, FeedInfo, Stage};
pub use job::Job;
pub use service::run;
