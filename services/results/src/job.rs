//! The settings of the process.

use std::path::PathBuf;

use deployment::results::Config;

use crate::Scene;

/// The settings of the process.
#[derive(Debug)]
pub struct Job {
    /// Names and geometry to which messages refer by number.
    pub scene: Scene,
    /// Settings that choose the files to write.
    pub config: Config,
    /// The output folder.
    pub output: PathBuf,
    /// First frame of the footage to use.
    pub start_frame: u64,
    /// Number of fusion workers.
    pub n_workers: usize,
    /// True if there are processes that send expected errors.
    pub has_quality: bool,
}
