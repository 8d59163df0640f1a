//! Task of the process.

use std::path::PathBuf;

use deployment::results::Config;

use crate::Scene;

/// Task of the process.
#[derive(Debug)]
pub struct Job {
    /// Names and geometry that the messages refer to by number.
    pub scene: Scene,
    /// Which files to write.
    pub config: Config,
    /// The output folder.
    pub output: PathBuf,
    /// First frame of the footage that is used.
    pub start_frame: u64,
    /// Number of fusion workers.
    pub n_workers: usize,
    /// True if there are processes that send expected errors.
    pub has_quality: bool,
}
