//! Finds people in single views: receives frames, and sends candidates with their evidence.

mod by_keypoints;
mod by_network;
mod job;
mod memory;
mod service;
mod settings;
mod view;

pub use job::{Job, Keypoints, Looks, Source, Step};
pub use service::run;
pub use settings::settings;
