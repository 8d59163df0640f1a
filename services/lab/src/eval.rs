//! Evaluation on sequences or pictures with known joints: solves frames, stores the results, and reports their scores.

pub mod as_run;
pub mod evidence;
pub mod pictures;

mod job;
mod progress;
mod report;

pub use job::{Done, Fusion, Job};
pub use report::{text, write_report};
