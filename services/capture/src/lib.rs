//! Reads the footage of a camera, and sends its frames.
#![forbid(unsafe_code)]

mod config;
mod fault;
mod feed;
mod guard;
mod service;
mod supply;

pub use config::{Camera, Config, Mode, Pace};
pub use fault::{Fault, FaultError, FaultKind, Faults};
pub use feed::{Feed, FeedError, FeedInfo, Stage};
pub use service::{Job, run};
