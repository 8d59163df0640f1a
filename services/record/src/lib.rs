//! Writes what a deployment leaves behind.
//!
//! Reading order: [`Scene`] (what the numbers in messages mean), [`FrameRecord`] (all messages about
//! one frame), the writers of one format each, and [`Output`], which puts them together.
#![forbid(unsafe_code)]

mod config;

mod scene;

mod frame;

mod latency;
mod pose2d;
mod pose3d;
mod trc;

mod folder;

mod output;

pub use config::Config;
pub use folder::{Folder, FolderError};
pub use frame::{FrameRecord, ViewRecord};
pub use latency::Latency;
pub use output::Output;
pub use scene::{Scene, View};

#[cfg(test)]
mod testing;
