//! Work from files to files, away from cameras: training runs, the evaluation, a model tried on pictures, sequences of
//! people who do not exist.
//!
//! The algorithms are in crates of their own; here they are given files, threads, a [`Stop`](runtime::Stop) and a
//! [`Console`], and their errors become a [`Failure`](runtime::Failure) with an exit status and a hint.
//!
//! * [`person`]: a model that finds people, from annotated people.
//! * [`consistency`]: what several views of a person have in common, from sequences with truth.
//! * [`quality`]: the samples of the network that predicts the errors of single views, and its training.
//! * [`orientation`]: the network that tells the direction in which a person faces.
//! * [`posetraining`]: the network that finds joints, from annotated people and scenes.
//! * [`boards`]: boards to calibrate with, looked for in footage.
//! * [`eval`]: the evaluation on sequences or pictures whose joints are known.
//! * [`joints`]: where joints lie among the parts of a model, from annotated people.
//! * [`springs`]: the springs between joints, from annotated people.
//! * [`judged`]: a model tried on people whose joints are known.
//! * [`examples`]: what a model takes for each type of its parts.
//! * [`network`]: networks that find keypoints, with their cards; [`detector`]: detectors of people; [`described`]: whichever a
//!   file is; [`library`]: what runs them.
//! * [`pictures`]: pictures and videos that are searched; [`sheet`]: thumbnails with what was found.
//! * [`smooth`]: the trajectories of a finished run smoothed, with angles, and against the truth.
//! * [`synth`]: sequences of people who do not exist, with the truth.
#![forbid(unsafe_code)]

mod console;
mod failures;
mod interrupt;
mod memory;
mod scenes;
mod searches;

pub mod images;

pub mod boards;
pub mod cards;
pub mod consistency;
pub mod described;
pub mod detector;
pub mod eval;
pub mod examples;
pub mod joints;
pub mod judged;
pub mod judged_network;
pub mod library;
pub mod network;
pub mod orientation;
pub mod person;
pub mod pictures;
pub mod posetraining;
pub mod quality;
pub mod sheet;
pub mod smooth;
pub mod springs;
pub mod synth;

pub use console::Console;
pub use failures::{dataset_failure, film_failure, sequence_failure};
pub use interrupt::unless_stopped;
