//! Work from files to files: trainings, evaluations, models tried on pictures, synthetic sequences.
//!
//! The algorithms are in crates of their own, but for the [`evaluation`]; here they are given files, threads, a [`Stop`](failure::Stop) and a
//! [`Console`](failure::Console), and their errors become a [`Failure`](failure::Failure) with an exit status and a hint.
#![forbid(unsafe_code)]

pub mod evaluation;
mod failures;
mod prepared;
mod scenes;
mod searches;
mod trained;

pub mod consistency;
pub mod eval;
pub mod finding;
pub mod forecast;
pub mod joints;
pub mod judged;
pub mod judged_network;
pub mod model_page;
pub mod orientation;
pub mod person;
pub mod posetraining;
pub mod quality;
pub mod several;
pub mod smoothed;
pub mod synth;

pub use failures::{dataset_failure, sequence_failure};
