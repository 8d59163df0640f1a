//! What the process has to do.

use std::path::PathBuf;

use crate::{Config, Scene};

/// What the process has to do.
#[derive(Debug)]
pub struct Job {
    /// What the numbers in messages mean.
    pub scene: Scene,
    /// What to leave behind.
    pub config: Config,
    /// Where.
    pub output: PathBuf,
    /// First frame of the footage that is used.
    pub start_frame: u64,
    /// Number of fusion workers.
    pub n_workers: usize,
    /// Whether there are processes that send expected errors.
    pub has_quality: bool,
}
