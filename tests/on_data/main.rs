//! Tests on real data. They are skipped if the data folder is not beside the repository.
//!
//! `cargo test --workspace --test on_data -- --ignored --nocapture`

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]
#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "the tests print the figures that they measure"
)]

mod annotations;
mod balancing;
mod calibration;
mod clocks;
mod footage;
mod iterations;
mod keypoint_files;
mod models;
mod motion;
mod multi_view;
mod parse_set;
mod people;
mod shipped;
mod single_view;
mod tiles;
mod together;
mod tracked;

use std::path::{Path, PathBuf};

/// Returns the folder with data and reference numbers. If it is absent, prints that the test is skipped, and returns `None`.
fn shared_dir() -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let dir = root.join("../shared");
    if dir.join("data").is_dir() && dir.join("reference").is_dir() {
        return Some(dir);
    }
    eprintln!(
        "skipped: no data and reference numbers in {}",
        dir.display()
    );
    None
}
