//! Learns the consistency parameters between views from people with known joints.
//!
//! This is the paper's section 5, "Consistency parameters". [`Learner`] takes single-view solutions together with the ground truth
//! ([`ViewObservation`]). From the solutions that are nearly right, it learns which part types occur together ([`Counts`]), the median
//! errors of parts (tau), and the map from parts to joints. [`Learned`] is the result, a file stored beside the model.
//!
//! [`Local`] learns the positions of joints relative to the parts around them, from annotated people in single views; [`JointFile`] stores
//! the result. This module does not read files or the clock.

mod counts;
mod file;

mod joint_file;
mod joints;
mod learn;
mod local;
mod model;
mod surface;

pub use counts::{Appearance, Counts, Shape, marginals};
pub use file::{
    FileError, JointWeights, Learned, LearnedFrom, ModelOf, NamedPair, NamedRig, Weights,
};
pub use joint_file::{JointFile, JointFileError, JointRow, JointsLearned, LearnedSet};
pub use joints::{JointFit, JointSample};
pub use learn::{LearnError, Learner, Pair, Settings, ViewObservation};
pub use local::{Local, Marked, Tried, best as best_local, mean_error, try_all};
pub use surface::{Grid, Point, Tally, best};

#[cfg(test)]
mod joint_tests;
#[cfg(test)]
mod tests;
