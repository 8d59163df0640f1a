//! Jobs that read and write files: training, evaluation, application of models to pictures, synthetic sequences.
//!
//! Except for the [`evaluation`], the algorithms are in other crates. This crate supplies files, threads, a [`Stop`](failure::Stop) and a
//! [`Console`](failure::Console). It turns errors into a [`Failure`](failure::Failure) with an exit status and a hint.
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
