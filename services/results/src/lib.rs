//! Writes the output files of a deployment.
//!
//! Reading order: [`Scene`] (the meaning of the numbers in messages), [`FrameRecord`] (all messages about one frame), one writer for each
//! format, and [`Output`], which combines the writers.
#![forbid(unsafe_code)]

mod scene;

mod frame;
mod missing;

mod latency;
mod overlay;
mod own;
mod pose2d;
mod pose3d;
mod times;
mod trc;

mod folder;
mod lines;

mod calibration;
mod people;
mod smooth;
mod summary;
mod trust;

mod output;

mod gather;
mod height;

mod job;
mod service;
mod writer;

pub use folder::{Folder, FolderError, remove_pictures};
pub use frame::{Absent, FrameRecord, FusedRecord, Picture, ViewRecord};
pub use job::Job;
pub use latency::Latency;
pub use missing::Missing;
pub use output::{Output, OutputError};
pub use scene::{Scene, View};
pub use service::run;

#[cfg(test)]
mod testing;
