//! Reads the footage of a camera, and sends its frames.
#![forbid(unsafe_code)]

mod camera;
mod feed;
mod guard;
mod job;
mod service;
mod supply;

pub use feed::{Feed, FeedError, FeedInfo, Stage};
pub use job::Job;
pub use service::run;
