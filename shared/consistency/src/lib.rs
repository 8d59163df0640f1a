//! What several views of a person have in common, learned from people whose joints are known.
//!
//! The paper's section 5, "Consistency parameters". [`Learner`] takes single views as they were solved, with the
//! truth ([`ViewObservation`]), and learns from those that are nearly right which part types come together
//! ([`Counts`]), how far off parts usually are (tau), and where joints lie among parts. [`Learned`] is
//! the file beside a model that holds it. Pure: nothing here reads a file or a clock.
#![forbid(unsafe_code)]

mod counts;
mod file;

mod joints;
mod learn;
mod surface;

pub use counts::{Counts, Shape, marginals};
pub use file::{
    Appearance, FileError, JointWeights, Learned, LearnedFrom, ModelOf, NamedPair, NamedRig,
    Weights,
};
pub use joints::{JointFit, JointSample};
pub use learn::{LearnError, Learner, Pair, Settings, ViewObservation};
pub use surface::{Grid, Point, Tally, best};

#[cfg(test)]
mod tests;
