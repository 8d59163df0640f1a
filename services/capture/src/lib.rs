//! Reads the footage of a camera, and sends its frames.
#![forbid(unsafe_code)]

mod config;
mod feed;
mod place;
mod service;

pub use config::{Camera, Config, Mode, Pace};
pub use feed::{Feed, FeedError, FeedInfo, Stage};
pub use service::{Job, run};
