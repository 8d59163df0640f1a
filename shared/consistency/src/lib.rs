//! Learns the consistency parameters between views from people with known joints.
//!
//! The paper's section 5, "Consistency parameters". [`Learner`] takes single-view solutions with the truth
//! ([`ViewObservation`]), and learns from those that are nearly right which part types occur together
//! ([`Counts`]), the median errors of parts (tau), and the map from parts to joints. [`Learned`] is the file
//! beside a model with the result. Nothing here reads a file or a clock.
#![forbid(unsafe_code)]

mod counts;
mod file;

mod joints;
mod learn;
mod model;
mod surface;

pub use counts::{Appearance, Counts, Shape, marginals};
pub use file::{
    FileError, JointWeights, Learned, LearnedFrom, ModelOf, NamedPair, NamedRig, Weights,
};
pub use joints::{JointFit, JointSample};
pub use learn::{LearnError, Learner, Pair, Settings, ViewObservation};
pub use surface::{Grid, Point, Tally, best};

#[cfg(test)]
mod tests;
