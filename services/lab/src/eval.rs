//! The evaluation on sequences or pictures whose joints are known: solved, kept, scored, reported.

pub mod as_run;
pub mod evidence;
pub mod pictures;

mod job;
mod progress;
mod report;

pub use job::{Done, Fusion, Job};
pub use report::{text, write_report};
